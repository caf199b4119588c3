#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "formats/nc/siemens_assignment.h"
#include "formats/nc/siemens_words.h"
#include "formats/nc/tree_builder.h"

namespace smoothpost::nc {

/// Splits the text of a Sinumerik 840D program: words (X10, X=R1+2, A3=0.1, X=AC(5), T="DRILL"),
/// assignments to R parameters and declared variables, statements (TRAORI, MSG("text"), CTOL=0.02),
/// lines of program flow, ; comments, / and /1 skip levels, %_N_NAME_MPF lines.
class SiemensBuilder final : public TreeBuilder {
 public:
  using TreeBuilder::TreeBuilder;
  std::unique_ptr<TreeBuilder> clone() const override {
    return std::make_unique<SiemensBuilder>(*this);
  }

 protected:
  void content(const char* begin) override;

 private:
  const char* item(const char* begin);
  const char* letter(const char* begin);
  const char* name(const char* begin, const char* name_end);
  const char* word_end(const char* begin, char letter, const ScannedNumber& scanned);
  const char* assigned(const char* begin, const char* name_end, const char* equals);
  const char* address(const char* begin, char address, const char* value);
  const char* tool_name(const char* begin, const char* quote);
  const char* call(const char* begin, const char* name_end);
  const char* flow(const char* begin);
  const char* modal_call(const char* begin, const char* name_end);
  const char* array(const char* begin, const char* bracket);
  const char* declaration(const char* begin);
  const char* procedure(const char* begin);
  const char* header(const char* begin);
  const char* program_call(const char* begin, const char* refused_end);
  bool begins_line() const;
  const char* statement(SiemensWord word, const char* begin, const char* end);
  const char* refuse_name(const char* begin, const char* name_end, const char* end);
  const char* refuse_value(const char* begin, const char* value, const Evaluated& found);
  const char* end_of_statement(const char* begin) const;
  const char* behind_name(const char* p) const;
  const char* behind_frame(const char* begin) const;
  const char* behind_group(const char* open, char close) const;

  void declare(const std::string& name);
  void forget_declared() { first_declared_ = declared_; }
  bool is_declared(const std::string& name) const;

  /// The variables of the program that is read are those that were declared with a number from
  /// first_declared_ to declared_ − 1. Of a name all its numbers in the text, which clones share.
  using Declarations = std::unordered_map<std::string, std::vector<std::uint32_t>>;
  std::shared_ptr<Declarations> declarations_ = std::make_shared<Declarations>();
  std::uint32_t first_declared_ = 0, declared_ = 0;
  std::size_t first_piece_ = 0;  ///< of this line
  bool header_ = false;          ///< this line is one
  bool program_began_ = false;   ///< behind its header words came
};

}  // namespace smoothpost::nc

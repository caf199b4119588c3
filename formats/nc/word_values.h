#pragma once

#include <vector>

#include "formats/nc/block_words.h"
#include "formats/nc/parameters.h"
#include "formats/nc/siemens_expression.h"

namespace smoothpost::nc {

/// Expressions and assignments of RS274NGC: an assignment takes effect when its block was read.
class Rs274Values final : public WordValues {
 public:
  Rs274Values(const InterpreterSettings& settings, ControllerState state)
      : modal_(state.modal), parameters_(settings, state) {}

  Evaluated word(std::string_view text, WordForm form) override;
  Evaluated assign(std::string_view text) override;
  void finish_block(bool good) override;
  bool inch() const override { return modal_.unit != 1.0; }

 private:
  const ModalState& modal_;
  Parameters parameters_;
  std::vector<EvaluatedAssignment> pending_;
};

/// Expressions, assignments and declarations of Sinumerik programs: they take effect from left to
/// right.
class SiemensValues final : public WordValues {
 public:
  explicit SiemensValues(const ModalState& modal) : modal_(modal) {}

  Evaluated word(std::string_view text, WordForm form) override;
  Evaluated assign(std::string_view text) override;
  void finish_block(bool) override {}
  bool inch() const override { return modal_.unit != 1.0; }

 private:
  Evaluated declare(std::string_view text);

  const ModalState& modal_;
  SiemensVariables variables_;
};

}  // namespace smoothpost::nc

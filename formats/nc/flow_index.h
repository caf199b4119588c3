#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "formats/nc/flow_words.h"
#include "formats/nc/program.h"

namespace smoothpost::nc {

/// A line of program flow and the one that it belongs to.
struct FlowStatement {
  static constexpr std::uint32_t kNone = 0xffffffff;

  FlowText text;
  std::uint32_t block = 0;
  std::uint32_t begin = 0;  ///< bytes of Program::text that `text` was read from
  std::uint32_t length = 0;
  std::uint32_t column = 0;
  bool closes_do = false;         ///< while at the end of do
  std::uint32_t partner = kNone;  ///< sub and endsub, loop begin and end; if, elseif: the next one
                                  ///< of the branch; break, continue: the begin of the loop
  std::uint32_t end = kNone;  ///< if, elseif, else: their endif; break, continue: the loop's end
  std::string fault;          ///< why it has no partner or may not stand here; empty: good
};

/// Where the flow of one program text can go. Statements are indices into `statements`.
struct FlowIndex {
  struct Numbered {
    std::uint32_t region = 0;  ///< block of the O number that it stands behind; 0: none before
    long number = 0;           ///< of its N word
    std::uint32_t block = 0;
  };

  struct ProgramLabel {
    std::uint32_t block = 0;
    bool twice = false;  ///< the number stands in the text more than once
  };

  /// A program of a Sinumerik text: from %_N_NAME_SPF, or PROC behind an end, to the next one.
  struct Section {
    std::string name;         ///< upper case; empty: the text before the first of such lines
    std::uint32_t begin = 0;  ///< block
    std::uint32_t end = 0;    ///< block behind the last one
    bool procedure = false;   ///< it has a PROC
    bool subprogram = false;  ///< %_N_NAME_SPF or PROC
  };

  std::vector<FlowStatement> statements;                ///< in order of the text
  std::unordered_map<std::string, std::uint32_t> subs;  ///< sub statements by label
  std::map<long, ProgramLabel> programs;                ///< O numbers that stand alone
  std::vector<std::uint32_t> regions;                   ///< their blocks, rising
  std::vector<Numbered> numbers;                        ///< sorted; not of linuxcnc
  std::unordered_map<std::string, std::vector<std::uint32_t>> labels;  ///< siemens NAME:, by block
  std::vector<Section> sections;                                       ///< siemens, at least one

  /// The statement of a block; @pre the block has one.
  std::uint32_t of_block(std::uint32_t block) const;
  /// The block of the last O number at or before `block`, 0 when there is none.
  std::uint32_t region_of(std::uint32_t block) const;
  /// The section that a block stands in. @pre siemens
  const Section& section_of(std::uint32_t block) const;
  /// The section of that name; nullptr: there is none.
  const Section* section(const std::string& name) const;
  /// Blocks with N`number` in a region, at most two.
  std::vector<std::uint32_t> numbered(std::uint32_t region, long number) const;
};

/// Pairs the statements of a program: each end with the begin that is open before it, by kind and
/// label; those of siemens within one section. Faults stand with their statement: a missing or
/// crossed partner, a subroutine within a subroutine or a loop, a label that its subroutine (or the
/// main program) has already used, return outside a subroutine, break and continue outside a while
/// or do of their label, more than 100 of them within each other. Cost: one pass over the pieces.
class FlowIndexer {
 public:
  explicit FlowIndexer(InputDialect dialect);
  ~FlowIndexer();
  /// Takes the blocks that are in `window`, which follow those of the window before.
  void add(const Program& window);
  /// The index of the `blocks` blocks of the text. Once.
  FlowIndex finish(std::size_t blocks);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The index of a program that is not read in windows. @pre program.is_whole()
FlowIndex index_flow(const Program& program);

}  // namespace smoothpost::nc

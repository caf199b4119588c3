#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>

#include "formats/nc/codes.h"
#include "formats/nc/diagnostic_log.h"
#include "formats/nc/flow_index.h"
#include "formats/nc/parameter_store.h"
#include "formats/nc/program.h"

namespace smoothpost::nc {

/// A text that blocks are run from: the program, or the file of a subroutine.
struct ProgramUnit {
  const Program* program = nullptr;
  std::unique_ptr<Program> owned;                  ///< of a file
  std::string path;                                ///< of that file
  std::optional<FlowIndex> index;                  ///< made when the flow first asks for it
  std::unordered_map<std::uint32_t, long> counts;  ///< runs left of repeat loops, by statement
};

/// The modal state that M70 and M73 keep.
struct SavedState {
  double unit = 1.0, feed_unit = 1.0;
  GCode plane = 170;
  bool incremental = false, arc_absolute = false, inverse_time = false, per_turn = false,
       retract_to_old = false, diameter = false;
  double linear_feed = 0.0, angular_feed = 0.0, speed = 0.0;
  int system = 1;
  double tool_length = 0.0;
  int length_tool = 0;
  int spindle = 5;
  bool mist = false, flood = false;
};

/// One level of the run: the main program, or a call and where it goes back to.
struct CallFrame {
  enum class Style : std::uint8_t {
    main,
    oword,    ///< o<name> call ... endsub
    program,  ///< M98, M97, G65 ... M99
    siemens,  ///< L100, NAME(..) ... M17
    part      ///< siemens REPEAT: a part of the program that calls it
  };
  Style style = Style::main;
  ProgramUnit* caller = nullptr;
  std::size_t return_block = 0;
  std::uint32_t caller_input_line = 0;  ///< as BlockReader::select takes it
  TextPlace place;                      ///< of the call, in the caller's text
  std::size_t entry = 0;                ///< first block of the body
  std::size_t end = 0;                  ///< block behind its last one; 0: the end of the text
  std::size_t caller_begin = 0, caller_end = 0;  ///< the blocks that the caller may run
  long repeats_left = 0;                         ///< further runs of the body
  CallScope scope;
  std::optional<SavedState> saved;
  bool restores = false;  ///< M73: at the end of the call
};

}  // namespace smoothpost::nc

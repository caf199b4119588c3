#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "formats/nc/interpreter.h"

namespace smoothpost::conversational {

struct ReadingSummary {
  bool ended = false;  ///< M2, M30 or END PGM
  std::uint32_t lines = 0;
  std::vector<std::string> tools;    ///< numbers or names that were changed to, in order
  std::vector<std::string> assumes;  ///< what the reading took for granted, for the certificate
};

/// Reads a conversational program of Heidenhain controls (.h), runs its jumps, repeats and
/// subprograms, and calls `sink` for every motion, dwell, event and comment in the order in which
/// the control would act (docs/formats_heidenhain.md).
///
/// X Y Z are those of the active datum: preset (system 1 to 9 of the settings' work offsets), datum
/// shift, rotation or tilted plane. Under M128 or FUNCTION TCPM motions have CanonicalMotion::tcp;
/// LN with TX TY TZ and motions in a tilted plane have axis_vector too. Rotary words elsewhere are
/// joint positions of the input machine. The length of a tool is that of the settings.
///
/// Errors are collected; with one the result has no value and what `sink` got is not a program. A
/// fault of the flow (a label that is missing, a condition without value) ends the run. Any bytes
/// end in a value or in located diagnostics.
///
/// Cost: linear in the text and in what runs; beyond the text's length settings.run_budget bounds
/// blocks that run again and strokes of cycles. Memory: 8 bytes a block beside the text.
/// @param text  the file   @param file_name  for messages only
/// @return codes NC400 to NC420, PR101, PR103
Result<ReadingSummary> read(std::string_view text, const std::string& file_name,
                            const nc::InterpreterSettings& settings, CanonicalSink& sink);

}  // namespace smoothpost::conversational

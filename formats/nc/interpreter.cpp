#include "formats/nc/interpreter.h"

#include "formats/nc/event_words.h"
#include "formats/nc/executor.h"
#include "kernels/core/contract.h"

namespace smoothpost::nc {

Result<InterpretationSummary> interpret(const Program& program, const InterpreterSettings& settings,
                                        CanonicalSink& sink) {
  const Result<EventMatcher> matcher = EventMatcher::compile(settings.process);
  if (!matcher.ok()) return Result<InterpretationSummary>::failure(matcher.diagnostics());
  require(program.is_whole(), "a whole program; windows of one are run by its stream");
  return Executor(program, settings, matcher.value(), sink).run();
}

Result<InterpretationSummary> interpret(ProgramStream& stream, const InterpreterSettings& settings,
                                        CanonicalSink& sink) {
  const Result<EventMatcher> matcher = EventMatcher::compile(settings.process);
  if (!matcher.ok()) {
    while (stream.next()) {
    }
    return Result<InterpretationSummary>::failure(matcher.diagnostics());
  }
  require(stream.program().first_block == 0, "a stream that has not been run");
  for (;;) {
    auto result = Executor(stream.program(), settings, matcher.value(), sink, &stream).run();
    if (!stream.begins_again()) return result;
  }
}

}  // namespace smoothpost::nc

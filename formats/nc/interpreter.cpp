#include "formats/nc/interpreter.h"

#include "formats/nc/event_words.h"
#include "formats/nc/executor.h"

namespace smoothpost::nc {

Result<InterpretationSummary> interpret(const Program& program, const InterpreterSettings& settings,
                                        CanonicalSink& sink) {
  const Result<EventMatcher> matcher = EventMatcher::compile(settings.process);
  if (!matcher.ok()) return Result<InterpretationSummary>::failure(matcher.diagnostics());
  return Executor(program, settings, matcher.value(), sink).run();
}

}  // namespace smoothpost::nc

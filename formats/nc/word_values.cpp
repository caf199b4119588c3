#include "formats/nc/word_values.h"

#include <algorithm>
#include <cmath>

#include "formats/nc/macro_variables.h"
#include "formats/nc/number.h"
#include "formats/nc/parameters.h"

namespace smoothpost::nc {
namespace {

/// `text` from `offset` on, evaluated by `evaluate`; places count from the start of `text`.
template <typename Evaluate>
Evaluated behind(std::string_view text, std::size_t offset, Evaluate&& evaluate) {
  Evaluated found = evaluate(text.substr(offset));
  found.at += offset;
  found.length += offset;
  return found;
}

}  // namespace

Rs274Values::Rs274Values(const InterpreterSettings& settings, InputDialect dialect,
                         ControllerState state)
    : modal_(state.modal), rules_(ExpressionRules::fanuc) {
  if (dialect == InputDialect::linuxcnc) {
    rules_ = ExpressionRules::linuxcnc;
    store_ = std::make_unique<Parameters>(settings, state);
  } else {
    store_ = std::make_unique<MacroVariables>(state);
  }
}

Evaluated Rs274Values::word(std::string_view text, WordForm) {
  Evaluated found = behind(text, 1, [&](std::string_view rest) { return value(rest); });
  if (found.ok() && std::isnan(found.value)) {
    found.problem = "it is vacant, and the control passes over the word; give it a value before";
    found.at = 0;
  }
  return found;
}

Evaluated Rs274Values::assign(std::string_view text) {
  EvaluatedAssignment assignment = evaluate_assignment(text, store_.get(), rules_);
  if (assignment.value.ok()) {
    assignment.value.problem = store_->refusal(assignment);
    if (assignment.value.ok()) pending_.push_back(assignment);
  }
  return assignment.value;
}

void Rs274Values::finish_block(bool good) {
  if (good) {
    for (const EvaluatedAssignment& assignment : pending_) store_->assign(assignment);
  }
  pending_.clear();
}

Evaluated SiemensValues::word(std::string_view text, WordForm form) {
  const std::size_t equals = text.find('=');
  std::size_t offset = equals == std::string_view::npos ? 1 : equals + 1;
  if (form != WordForm::expression) offset = text.find('(', offset);
  return behind(text, offset,
                [&](std::string_view rest) { return evaluate_siemens(rest, &variables_); });
}

Evaluated SiemensValues::assign(std::string_view text) {
  const auto begins = [&](std::string_view word) {
    return text.size() > word.size() && upper_text(text.substr(0, word.size())) == word &&
           detail::is_blank(text[word.size()]);
  };
  if (begins("DEF")) return declare_siemens(text, &variables_, nullptr);
  if (begins("PROC")) return bind(text);
  return assign_siemens(text, &variables_);
}

/// PROC: its parameters take the arguments of the call, or their defaults.
Evaluated SiemensValues::bind(std::string_view text) {
  Evaluated out;
  SiemensProcedure head = read_siemens_procedure(text);
  out.problem = std::move(head.problem);
  out.length = text.size();
  const CallScope* call = calls_.empty() ? nullptr : &calls_.back();
  const std::size_t count = head.parameters.size();
  if (call == nullptr && count > 0) {
    out.problem = "a subprogram with parameters was not called; name the program that calls it";
  }
  if (!out.ok()) return out;
  for (auto& [name, variable] : head.parameters) {
    out.problem = variables_.declare(name, std::move(variable));
    if (!out.ok()) return out;
  }
  if (call == nullptr) return out;
  for (const auto& [place, value] : call->arguments) {
    const auto number = static_cast<std::size_t>(place);
    if (number >= count) {
      out.problem = "the call gives more values than the " + std::to_string(count) +
                    " parameters of the subprogram";
      return out;
    }
    out.problem = variables_.assign(head.parameters[number].first, {}, value);
    if (!out.ok()) return out;
  }
  return out;
}

void SiemensValues::enter_call(const CallScope& scope) {
  variables_.enter();
  calls_.push_back(scope);
}

void SiemensValues::leave_call() {
  variables_.leave();
  calls_.pop_back();
}

}  // namespace smoothpost::nc

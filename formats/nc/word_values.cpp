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

std::string name_before(std::string_view text, std::size_t end) {
  while (end > 0 && detail::is_blank(text[end - 1])) --end;
  std::size_t begin = 0;
  while (begin < end && detail::is_blank(text[begin])) ++begin;
  return upper_text(text.substr(begin, end - begin));
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
  const std::size_t equals = text.find('=');
  if (upper_text(text.substr(0, 3)) == "DEF" && text.size() > 3 && detail::is_blank(text[3])) {
    return declare(text);
  }
  const Evaluated found = behind(
      text, equals + 1, [&](std::string_view rest) { return evaluate_siemens(rest, &variables_); });
  if (found.ok()) variables_.assign(name_before(text, equals), found.value);
  return found;
}

/// The builder has checked the text: DEF, a type, names with or without a value, commas.
Evaluated SiemensValues::declare(std::string_view text) {
  std::size_t at = 3;
  const auto skip_blanks = [&] {
    while (at < text.size() && detail::is_blank(text[at])) ++at;
  };
  skip_blanks();
  while (at < text.size() && !detail::is_blank(text[at])) ++at;  // the type
  Evaluated found;
  while (at < text.size()) {
    const std::size_t end = std::min(text.find_first_of(",=", at), text.size());
    const std::string name = name_before(text.substr(at), end - at);
    double value = 0.0;
    at = end;
    if (at < text.size() && text[at] == '=') {
      found = behind(text, at + 1,
                     [&](std::string_view rest) { return evaluate_siemens(rest, &variables_); });
      if (!found.ok()) return found;
      value = found.value;
      at = found.length;
      skip_blanks();
    }
    variables_.assign(name, value);
    ++at;  // the comma
  }
  return found;
}

}  // namespace smoothpost::nc

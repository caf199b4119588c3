#include "formats/heidenhain/executor.h"

// Labels, repeats, subprograms, jumps and Q parameters.
namespace smoothpost::conversational {
namespace {

constexpr std::size_t kDeepest = 19;  // subprograms within each other

}  // namespace

void Executor::find_labels() {
  for (std::size_t i = 0; i < source_.size(); ++i) {
    const Statement statement = source_.read(i);
    Scanner scanner(statement.text);
    has_corners_ = has_corners_ || scanner.sees("RND") || scanner.sees("CHF");
    if (!scanner.take("LBL")) continue;
    std::string label;
    if (!take_label(scanner, label) || label == "0") continue;
    if (!labels_.emplace(label, i).second)
      log_.error("NC406", "the label " + label + " stands twice", source_.place(0));
  }
}

/// A number or a "name".
bool Executor::take_label(Scanner& scanner, std::string& label) {
  if (const auto name = scanner.quoted()) {
    label = "\"" + *name + "\"";
    return true;
  }
  const auto number = scanner.whole();
  if (number) label = std::to_string(*number);
  return number.has_value();
}

void Executor::label(Scanner& scanner) {
  std::string label;
  if (!take_label(scanner, label))
    return error("NC406", "LBL needs a number or a \"name\"", scanner.offset());
  if (!no_more(scanner) || label != "0" || frames_.size() == 1) return;
  next_ = frames_.back().back;
  frames_.pop_back();
}

/// The block of the label that stands here.
std::optional<std::size_t> Executor::target_of(Scanner& scanner) {
  std::string label;
  const std::size_t offset = scanner.offset();
  if (!take_label(scanner, label)) {
    error("NC406", "a label is expected: a number or a \"name\"", offset);
    stopped_ = true;
    return {};
  }
  const auto found = labels_.find(label);
  if (found != labels_.end()) return found->second;
  error("NC406", "the label " + label + " does not exist", offset);
  stopped_ = true;
  return {};
}

/// CALL LBL n: a subprogram up to LBL 0. CALL LBL n REP k: the part from LBL n to here k times
/// more.
void Executor::call_label(Scanner& scanner) {
  send_held(nullptr);
  const auto target = target_of(scanner);
  if (!target) return;
  if (!scanner.take("REP")) {
    if (!no_more(scanner)) return;
    if (frames_.size() > kDeepest) {
      error("NC407", "more than 19 subprograms within each other", 0);
      stopped_ = true;
      return;
    }
    frames_.push_back({next_, {}});
    next_ = *target;
    return;
  }
  const auto times = scanner.whole();
  if (!times || (scanner.take_byte('/') && !scanner.whole())) {
    error("NC406", "REP needs a whole number", scanner.offset());
    stopped_ = true;
    return;
  }
  if (!no_more(scanner)) return;
  auto& repeats = frames_.back().repeats;
  const auto left = repeats.emplace(at_, *times).first;
  if (left->second == 0) {
    repeats.erase(left);
    return;
  }
  --left->second;
  next_ = *target;
}

/// FN n: ...
void Executor::function(Scanner& scanner) {
  const auto number = scanner.whole();
  if (!number || !scanner.take_byte(':'))
    return error("NC401", "FN needs its number and a colon", scanner.offset());
  if (*number <= 8 || *number == 13) return assign(scanner);
  if (*number >= 9 && *number <= 12) return condition(scanner, static_cast<int>(*number));
  if (*number == 15 || *number == 16) return;  // prints
  if (*number == 14)
    return error("NC402", "FN 14 ends the program with an error where the flow comes to it", 0);
  error("NC402",
        "FN " + std::to_string(*number) +
            " is not read: it takes a value from the running control, or gives it one",
        0);
  // What would follow from the value that is missing is told once.
  scanner.take("SYSREAD");
  if (const auto name = Variables::take_name(scanner)) variables_.set(*name, 0.0);
}

void Executor::condition(Scanner& scanner, int number) {
  if (!scanner.take("IF")) return error("NC401", "IF is expected", scanner.offset());
  const auto fail = [&] { stopped_ = true; };
  const auto first = value(scanner);
  if (!first) return fail();
  int found = 0;
  constexpr std::string_view kOperators[] = {"EQU", "NE", "GT", "LT"};
  for (int i = 0; i < 4 && found == 0; ++i)
    if (scanner.take(kOperators[i])) found = 9 + i;
  if (found == 0 || (number != 0 && found != number)) {
    error("NC401", "EQU (FN 9), NE (FN 10), GT (FN 11) or LT (FN 12) is expected",
          scanner.offset());
    return fail();
  }
  const auto second = value(scanner);
  if (!second) return fail();
  if (!scanner.take("GOTO") || !scanner.take("LBL")) {
    error("NC401", "GOTO LBL is expected", scanner.offset());
    return fail();
  }
  const auto target = target_of(scanner);
  if (!target || !no_more(scanner)) return;
  const double a = *first;
  const double b = *second;
  const bool holds = found == 9 ? a == b : found == 10 ? a != b : found == 11 ? a > b : a < b;
  if (!holds) return;
  send_held(nullptr);
  next_ = *target;
}

/// Qn = formula
void Executor::assign(Scanner& scanner) {
  const std::size_t offset = scanner.offset();
  const auto name = Variables::take_name(scanner);
  if (!name || !scanner.take_byte('='))
    return error("NC401",
                 "a Q parameter (Q, QL or QR with a number of 0 to 1999) and = are expected; texts "
                 "(QS) are not read",
                 offset);
  const Value result = variables_.formula(scanner);
  if (!result.ok()) {
    variables_.set(*name, 0.0);  // one message for one fault
    return error("NC405", result.problem, result.offset);
  }
  if (no_more(scanner)) variables_.set(*name, result.value);
}

}  // namespace smoothpost::conversational

#include <charconv>
#include <cmath>

#include "formats/cl/executor.h"
#include "formats/nc/number_text.h"

namespace smoothpost::cl {
namespace {

constexpr double kFastestSpindle = 1.0e6;  // rpm
constexpr double kMostTools = 99999.0;
constexpr double kLongestDwell = 86400.0;  // s

constexpr const char* kSpindleForm = "SPINDL/n,RPM,CLW or CCLW, SPINDL/ON, SPINDL/OFF";

bool is_word(const Item& item, std::string_view upper_case) {
  return item.kind == Item::Kind::word && same_word(item.text, upper_case);
}

}  // namespace

void Executor::event(const char* name, const Statement& statement,
                     std::vector<std::pair<std::string, std::string>> parameters) {
  ProcessEvent event;
  event.name = name;
  event.parameters = std::move(parameters);
  event.line = statement.place.line;
  event.column = statement.place.column;
  sink_.event(event);
}

void Executor::comment(std::string_view text, TextPlace place) {
  if (!text.empty()) sink_.comment(text, place.line);
}

/// Number, RPM, direction and ON or OFF in any order.
void Executor::spindle(const Statement& statement) {
  const Item* number = nullptr;
  const Item* state = nullptr;
  bool on = true;
  bool reverse = spindle_reverse_;
  for (const Item& item : statement.items) {
    if (item.kind == Item::Kind::number && number == nullptr) {
      number = &item;
    } else if (is_word(item, "RPM")) {
      continue;
    } else if (is_word(item, "CLW") || is_word(item, "CCLW")) {
      reverse = is_word(item, "CCLW");
      state = &item;
    } else if (is_word(item, "ON") || is_word(item, "OFF")) {
      on = is_word(item, "ON");
      state = &item;
    } else {
      error("CL151",
            "SPINDL with " + quoted(item.text) + " is not read; expected is " + kSpindleForm,
            item.place);
      return;
    }
  }
  if (number != nullptr && !(number->value >= 0.0 && number->value <= kFastestSpindle)) {
    error("CL151", "a spindle speed outside 0 to 1000000 rpm", number->place);
    return;
  }
  if (number == nullptr && state == nullptr) {
    error("CL151", std::string("expected is ") + kSpindleForm, statement.place);
    return;
  }
  if (number != nullptr) rpm_ = number->value;
  spindle_reverse_ = reverse;
  spindle_on_ = on && rpm_ > 0.0;
  if (on && number == nullptr && rpm_ == 0.0) {
    error("CL151", "the spindle is switched on and no speed was given; write SPINDL/n,RPM before",
          statement.place);
    return;
  }
  emit_spindle(statement);
}

void Executor::emit_spindle(const Statement& statement) {
  if (!spindle_on_) return event(event_name::kSpindleOff, statement);
  event(spindle_reverse_ ? event_name::kSpindleOnReverse : event_name::kSpindleOn, statement,
        {{"rpm", nc::shortest_text(rpm_)}});
}

/// LOADTL/n: the tool is at `first` among the values; behind it only its registers and length.
void Executor::load_tool(const Statement& statement, std::size_t first) {
  const auto& items = statement.items;
  const auto fail = [&](std::string text, TextPlace place) {
    error("CL110", std::move(text) + ", expected is LOADTL/n or LOAD/TOOL,n", place);
  };
  if (items.size() <= first) return fail("the tool is missing", statement.place);
  const Item& tool = items[first];
  std::string name;
  if (tool.kind == Item::Kind::number) {
    if (!(tool.value >= 0.0 && tool.value <= kMostTools && tool.value == std::floor(tool.value)))
      return fail(quoted(tool.text) + " is not a tool number of 0 to 99999", tool.place);
    name = nc::shortest_text(tool.value);
  } else if (tool.kind == Item::Kind::word) {
    name = tool.text;
  } else {
    return fail("the tool is missing", tool.place);
  }
  for (std::size_t i = first + 1; i < items.size(); i += 2) {
    const bool known =
        is_word(items[i], "ADJUST") || is_word(items[i], "OSETNO") || is_word(items[i], "LENGTH");
    if (!known || i + 1 >= items.size() || items[i + 1].kind != Item::Kind::number)
      return fail(quoted(items[i].text) + " is not read", items[i].place);
  }
  described_tool_ = -1;
  summary_.tools.push_back(name);
  event(event_name::kToolChange, statement, {{"tool", std::move(name)}});
}

/// NX and CAMWorks write LOAD/TOOL,n.
void Executor::load(const Statement& statement) {
  if (!statement.items.empty() && is_word(statement.items.front(), "TOOL"))
    return load_tool(statement, 1);
  unmapped(statement);
}

/// SELECT/TOOL,n makes the next tool ready, which is the control's affair.
void Executor::select(const Statement& statement) {
  if (!statement.items.empty() && is_word(statement.items.front(), "TOOL")) return;
  unmapped(statement);
}

/// TOOLNO/n,...: what tool n is.
void Executor::describe_tool(const Statement& statement) {
  const std::string text = scanner_.written();
  const std::size_t slash = text.find('/');
  if (slash != std::string::npos) {
    std::size_t begin = text.find_first_not_of(" \t", slash + 1);
    if (begin == std::string::npos) begin = text.size();
    long number = -1;
    const auto end = std::from_chars(text.data() + begin, text.data() + text.size(), number);
    const std::string name = std::to_string(number);
    const bool loaded = !summary_.tools.empty() && summary_.tools.back() == name;
    if (end.ec == std::errc() && number >= 0 && !loaded) described_tool_ = number;
  }
  comment(text, statement.place);
}

void Executor::coolant(const Statement& statement) {
  const char* name = nullptr;
  if (statement.items.size() == 1) {
    const Item& item = statement.items.front();
    if (is_word(item, "ON") || is_word(item, "FLOOD")) name = "coolant_on";
    if (is_word(item, "MIST")) name = "coolant_mist";
    if (is_word(item, "OFF")) name = "coolant_off";
  }
  if (name == nullptr) return unmapped(statement);
  event(name, statement);
}

/// The coordinates are those of the tool's centre line already.
void Executor::cutter_compensation(const Statement& statement) {
  const bool off = statement.items.size() == 1 && is_word(statement.items.front(), "OFF");
  if (off || !once(compensation)) return;
  log_.warning("CL160",
               "CUTCOM: the coordinates are the tool's own and stay as they are; the control's "
               "compensation of wear is not carried over",
               statement.place);
}

/// DELAY/s or DWELL/s.
void Executor::dwell(const Statement& statement) {
  if (!read_numbers(statement, {1}, "DELAY/seconds")) return;
  if (numbers_[0] >= 0.0 && numbers_[0] <= kLongestDwell)
    return sink_.dwell(numbers_[0], statement.place.line);
  error("CL110", "a dwell has to be 0 to 86400 s", statement.items.front().place);
}

/// A row of the process table that is this statement.
bool Executor::act_on_row(const Statement& statement) {
  std::string text = scanner_.written();
  // The rows write a slash before the text of PPRINT and its like, with or without one here.
  if (statement.info != nullptr && statement.info->rest == Rest::line)
    text = std::string(statement.info->name) + "/" + std::string(statement.text);
  EventRows::Match match = rows_.find(text);
  if (match.row == nullptr) return false;
  event(match.row->event.c_str(), statement, std::move(match.values));
  return true;
}

void Executor::unmapped(const Statement& statement) {
  const std::string text = scanner_.written();
  if (settings_.process.unmapped == UnmappedWords::comment)
    return sink_.comment("unmapped: " + text, statement.place.line);
  error("PR101",
        quoted(text) +
            " says nothing that is known here: add a row to [process.events] whose text is this "
            "statement (--process FILE), or set process.unmapped = \"comment\" to keep such "
            "statements as comments that do nothing",
        statement.place);
}

}  // namespace smoothpost::cl

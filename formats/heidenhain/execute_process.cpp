#include <array>
#include <cmath>

#include "formats/heidenhain/executor.h"
#include "formats/nc/number_text.h"

// Tools, spindle and M functions.
namespace smoothpost::conversational {
namespace {

constexpr double kLargestTool = 99999.0;

/// M functions that change the way of the tool, or its speed by what only the machine knows.
struct RefusedFunction {
  int m;
  const char* reason;
};
constexpr std::array<RefusedFunction, 17> kRefused = {{
    {89, "calls a cycle at every position; write M99 in the blocks that drill"},
    {92, "is a position from a datum of the machine; write M91 or program coordinates"},
    {94, "changes how rotary positions count; write positions with their turns"},
    {97, "changes corners of a compensated radius; let the CAM post write R0"},
    {98, "changes corners of a compensated radius; let the CAM post write R0"},
    {112, "rounds corners by a tolerance of the machine"},
    {114, "corrects the position by the machine's geometry; write M128"},
    {115, "corrects the position by the machine's geometry; write M128"},
    {118, "lets somebody move the axes by hand"},
    {130, "is a position outside of the tilted plane; write PLANE RESET"},
    {136, "is a feed by turn of the spindle; write F in mm/min"},
    {138, "chooses rotary axes for tilting"},
    {140, "retracts along the tool axis up to the machine's limit; write the position"},
    {141, "switches off the supervision of a probe"},
    {144, "counts the machine's geometry into positions; write M128"},
    {145, "counts the machine's geometry into positions; write M128"},
    {197, "rounds a corner of a compensated radius; let the CAM post write R0"},
}};

/// Feed, display and supervision: the way stays as it is.
constexpr std::array<int, 22> kNoEffect = {6,   90,  101, 102, 103, 107, 108, 109, 110, 111, 113,
                                           116, 117, 120, 124, 129, 134, 135, 137, 142, 143, 150};
constexpr std::array<int, 5> kFeeds = {103, 109, 110, 111, 116};

bool is_any(int m, const auto& list) {
  for (const int other : list)
    if (m == other) return true;
  return false;
}

}  // namespace

/// Functions that act at the end of their block.
bool acts_late(int m) {
  constexpr std::array<int, 9> kLate = {0, 1, 2, 5, 9, 30, 99, 129, 150};
  return is_any(m, kLate);
}

/// A block of M functions, with S at most.
void Executor::functions(Scanner& scanner) {
  const auto read = words(scanner);
  if (!read) return;
  if (read->axes() != 0 || read->rapid || read->clockwise || read->tool_words != 0)
    return error("NC404", "coordinates in a block of M functions: write L before them", 0);
  if (read->feed) feed_ = read->feed;
  apply_functions(*read, false);
  apply_functions(*read, true);
}

/// STOP, with M functions at most.
void Executor::stop(Scanner& scanner) {
  send_held(nullptr);
  const auto read = words(scanner);
  if (!read) return;
  apply_functions(*read, false);
  apply_functions(*read, true);
  event(event_name::kStop);
}

void Executor::apply_functions(const MotionWords& words, bool after) {
  if (!after && words.speed) modal_.speed = *words.speed;
  for (std::size_t i = 0; i < words.m.size(); ++i)
    if (acts_late(words.m[i]) == after) apply_function(words.m[i], words.m_at[i], words);
}

void Executor::apply_function(int m, std::size_t offset, const MotionWords& words) {
  switch (m) {
    case 91:
      return;
    case 99:
      return drill(offset);
    case 126:
    case 127:
      nearest_turn_ = m == 126;
      return;
    case 128:
    case 129:
      return set_tcp(m == 128);
    default:
      break;
  }
  for (const auto& [refused, reason] : kRefused)
    if (refused == m)
      return error("NC402", "M" + std::to_string(m) + " is not read: it " + reason, offset);
  if (function_row(m, offset, words)) return;
  if (is_any(m, kFeeds))
    warn_once(feed_functions, "NC419",
              "M" + std::to_string(m) +
                  " changes the feed, which is planned anew: it does nothing "
                  "(first of such functions)",
              offset);
  if (is_any(m, kNoEffect)) return;
  switch (m) {
    case 0:
      return event(event_name::kStop);
    case 1:
      return event(event_name::kOptionalStop);
    case 2:
    case 30:
      return end_run();
    case 3:
    case 4:
    case 5:
      return spindle(m, nullptr);
    case 7:
      return event("coolant_mist");
    case 8:
      return event("coolant_on");
    case 9:
      return event("coolant_off");
    case 13:
    case 14:
      spindle(m - 10, nullptr);
      return event("coolant_on");
    default:
      break;
  }
  if (settings_.process.unmapped == UnmappedWords::comment) {
    sink_.comment("unmapped: M" + std::to_string(m), source_.place(0).line);
    return;
  }
  error("PR101",
        "M" + std::to_string(m) +
            " has no row in the process table: add one to [process.events] of the input's machine "
            "(--process FILE), or set process.unmapped = \"comment\"",
        offset);
}

/// A row of the process table for an M function; its other words are those of the block.
bool Executor::function_row(int m, std::size_t offset, const MotionWords& words) {
  if (m == 2 || m == 30 || m == 99) return false;
  nc::BlockWords block{};
  for (std::size_t i = 0; i < words.m.size() && i < nc::BlockWords::kMaxM; ++i) {
    block.m[i] = static_cast<std::int16_t>(words.m[i]);
    block.m_count = static_cast<int>(i) + 1;
  }
  block.m[0] = static_cast<std::int16_t>(m);  // a row is found by its first function
  if (block.m_count == 0) block.m_count = 1;
  const nc::EventMatch match = matcher_.match_m(m, block);
  if (match.row == nullptr) {
    if (match.near_row == nullptr || match.missing == 0) return false;
    error("PR103",
          "M" + std::to_string(m) + " is \"" + match.near_row->event +
              "\" in the process table with the word " + std::string(1, match.missing) +
              ", which a conversational block does not have; add a row without it",
          offset);
    return true;
  }
  const bool turns = m == 3 || m == 4 || m == 5;
  if (turns) {
    spindle(m, match.row);
    return true;
  }
  event(match.row->event.c_str(), nc::EventMatcher::values(*match.row, block, modal_));
  return true;
}

/// M3, M4 and M5; S that changes later repeats the event.
void Executor::spindle(int m, const nc::EventRow* row) {
  spindle_ = m;
  spindle_row_ = row;
  if (row != nullptr) {
    const nc::BlockWords block{};
    return event(row->event.c_str(), nc::EventMatcher::values(*row, block, modal_));
  }
  if (m == 5) return event(event_name::kSpindleOff);
  event(m == 3 ? event_name::kSpindleOn : event_name::kSpindleOnReverse,
        {{"rpm", nc::shortest_text(modal_.speed)}});
}

void Executor::event(const char* name, nc::EventParameters parameters) {
  ProcessEvent out;
  out.name = name;
  out.parameters = std::move(parameters);
  const nc::TextPlace place = source_.place(0);
  out.line = place.line;
  out.column = place.column;
  sink_.event(out);
}

/// TOOL CALL [number or "name"] [Z] [S] [F] [DL] [DR].
void Executor::tool_call(Scanner& scanner) {
  send_held(nullptr);
  std::string name;
  std::optional<double> number;
  if (const auto text = scanner.quoted()) {
    name = *text;
  } else if (!scanner.at_end() && scanner.peek() != 'Z' && scanner.peek() != 'S' &&
             scanner.peek() != 'F' && scanner.peek() != 'D' && scanner.peek() != 'X' &&
             scanner.peek() != 'Y') {
    number = value(scanner);
    if (!number) return;
    if (!(*number >= 0.0 && *number <= kLargestTool && *number == std::floor(*number)))
      return error("NC416", "a tool is a whole number of 0 to 99999 or a \"name\"", 0);
  }
  const double speed_before = modal_.speed;
  radius_delta_ = number || !name.empty() ? false : radius_delta_;
  while (!scanner.at_end()) {
    const std::size_t offset = scanner.offset();
    if (scanner.take("Z")) continue;
    if (scanner.take("X") || scanner.take("Y"))
      return error("NC402", "a tool axis other than Z is not read", offset);
    std::string_view word;
    for (const std::string_view known : {"DL", "DR2", "DR", "S", "F"})
      if (word.empty() && scanner.peek() == known[0] &&
          (known.size() == 1 || scanner.peek(1) == known[1]) &&
          (known.size() < 3 || scanner.peek(2) == known[2]))
        word = known;
    if (word.empty())
      return error("NC404", "`" + scanner.token() + "` has no meaning in TOOL CALL", offset);
    for (const char byte : word) scanner.take_byte(byte);
    if (word == "S" && scanner.take("MAX")) continue;
    const auto read = value(scanner);
    if (!read) return;
    if (word == "S") {
      if (*read < 0.0) return error("NC416", "S below 0", offset);
      modal_.speed = *read;
    } else if (word == "F") {
      if (*read > 0.0) feed_ = *read;
    } else if (word == "DL" && *read != 0.0) {
      return error("NC416",
                   "DL moves the tip against the program: let the CAM post write the path of the "
                   "tool that is mounted",
                   offset);
    } else if (word != "DL") {
      radius_delta_ = radius_delta_ || *read != 0.0;
    }
  }
  if (number || !name.empty()) {
    const long tool = number ? static_cast<long>(*number) : 0;
    if (tool != tool_ || name != tool_name_) change_tool(name, tool);
  }
  if (modal_.speed != speed_before && (spindle_ == 3 || spindle_ == 4))
    spindle(spindle_, spindle_row_);
}

void Executor::change_tool(const std::string& name, long number) {
  tool_ = number;
  tool_name_ = name;
  modal_.tool = static_cast<int>(number);
  modal_.tool_name = name;
  const std::string text = name.empty() ? std::to_string(number) : name;
  summary_.tools.push_back(text);
  event(event_name::kToolChange, {{"tool", text}});
  const auto found = settings_.tool_lengths.find(static_cast<int>(number));
  const bool known = name.empty() && found != settings_.tool_lengths.end();
  if (!known && (number != 0 || !name.empty()))
    warn_once(no_length, "NC420",
              "the length of tool " + text +
                  " is not given: the program describes the tip, machine positions are taken with "
                  "length 0 (first of such tools); give lengths by --tool N=LENGTH (mm)",
              0);
  const double length = known ? found->second : 0.0;
  AxisWords offset{};
  offset[2] = length;
  const bool same = offset == coordinates_.tool();
  coordinates_.set_tool(offset);
  if (!same) coordinates_.forget(4);
  sink_.tool_length(length, modal_.tool, source_.place(0).line);
}

}  // namespace smoothpost::conversational

#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

// Wrong programs made of right ones: each mutant is one fault that a file may get on its way, from
// a lost digit to a block too much. Nothing here knows what the text means.
namespace smoothpost::test {

enum class MutantKind : std::uint8_t {
  digit,         ///< one digit is another
  lost,          ///< one digit or decimal point is missing, or a digit stands twice
  sign,          ///< a sign is there that was not, or the other way round
  scale,         ///< a number is ten times as large or as small
  drop_block,    ///< a line is missing
  double_block,  ///< a line stands twice
  swap_blocks,   ///< two lines are exchanged, up to three lines apart
  swap_values,   ///< two numbers of a line are exchanged
  swap_axes,     ///< the axis letter of a word is another
  word,          ///< a word of a line is missing
  feed,          ///< another feed
  mode,          ///< another G code, interpolation or modal word
  event,         ///< an event's line is missing, doubled, or one to three lines off
  cut_off        ///< the end of the file is missing
};
inline constexpr std::array<const char*, 14> kMutantNames = {
    "digit",         "lost digit",     "sign",           "scale",        "dropped block",
    "doubled block", "swapped blocks", "swapped values", "swapped axes", "lost word",
    "feed",          "mode",           "event",          "cut off"};
inline constexpr int kMutantKinds = static_cast<int>(kMutantNames.size());

struct Mutant {
  std::string text;
  std::size_t line = 0;  ///< 0-based: the first that is another
};

/// Makes mutants of one text. The same seed makes the same mutant.
class Mutator {
 public:
  /// `events`: what lines of process events hold, as the machine's words begin.
  Mutator(std::string text, std::vector<std::string> events)
      : text_(std::move(text)), events_(std::move(events)) {
    for (std::size_t at = 0; at < text_.size();) {
      const std::size_t end = text_.find('\n', at);
      lines_.push_back(text_.substr(at, end == std::string::npos ? end : end - at));
      if (end == std::string::npos) break;
      at = end + 1;
    }
  }

  /// Nothing comes of it (an empty text) where the program has no place for that kind.
  Mutant make(MutantKind kind, std::uint32_t seed) const {
    std::mt19937 rng(seed);
    std::vector<std::string> lines = lines_;
    for (int attempt = 0; attempt < 20; ++attempt) {
      lines = lines_;
      if (!change(kind, lines, rng)) continue;
      if (lines != lines_) return joined(lines);
    }
    return {};
  }

 private:
  struct Number {
    std::size_t begin = 0;
    std::size_t size = 0;
  };

  static std::size_t below(std::mt19937& rng, std::size_t n) { return rng() % n; }
  static bool is_digit(char c) { return c >= '0' && c <= '9'; }

  static std::vector<Number> numbers_of(const std::string& line) {
    std::vector<Number> found;
    for (std::size_t i = 0; i < line.size();) {
      if (!is_digit(line[i]) && !(line[i] == '.' && i + 1 < line.size() && is_digit(line[i + 1]))) {
        ++i;
        continue;
      }
      const std::size_t begin = i;
      while (i < line.size() && (is_digit(line[i]) || line[i] == '.')) ++i;
      found.push_back({begin, i - begin});
    }
    return found;
  }

  Mutant joined(const std::vector<std::string>& lines) const {
    Mutant m;
    while (m.line < lines.size() && m.line < lines_.size() && lines[m.line] == lines_[m.line])
      ++m.line;
    for (const auto& line : lines) m.text += line + "\n";
    return m;
  }

  /// A line with numbers that is not one of the title's comments.
  std::size_t some_line(std::mt19937& rng) const {
    for (int attempt = 0; attempt < 50; ++attempt) {
      const std::size_t i = below(rng, lines_.size());
      if (lines_[i].find("moothpost 0") == std::string::npos &&
          lines_[i].find("sha256") == std::string::npos &&
          lines_[i].find("SHA256") == std::string::npos && !lines_[i].empty())
        return i;
    }
    return 0;
  }

  bool change(MutantKind kind, std::vector<std::string>& lines, std::mt19937& rng) const {
    const std::size_t i = some_line(rng);
    switch (kind) {
      case MutantKind::drop_block:
        lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(i));
        return true;
      case MutantKind::double_block: {
        const std::string twice = lines[i];
        lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(i), twice);
        return true;
      }
      case MutantKind::swap_blocks: {
        const std::size_t j = i + 1 + below(rng, 3);
        if (j >= lines.size()) return false;
        std::swap(lines[i], lines[j]);
        return true;
      }
      case MutantKind::cut_off:
        lines.resize(i + 1);
        return true;
      case MutantKind::event:
        return change_event(lines, rng);
      case MutantKind::mode:
        return change_mode(lines, rng);
      case MutantKind::feed:
        return change_feed(lines, rng);
      case MutantKind::swap_axes:
        return change_axis(lines[i], rng);
      case MutantKind::word:
        return drop_word(lines[i], rng);
      default:
        return change_number(kind, lines[i], rng);
    }
  }

  static bool change_number(MutantKind kind, std::string& line, std::mt19937& rng) {
    const std::vector<Number> numbers = numbers_of(line);
    if (numbers.empty()) return false;
    const Number n = numbers[below(rng, numbers.size())];
    const std::size_t at = n.begin + below(rng, n.size);
    if (kind == MutantKind::digit) {
      if (!is_digit(line[at])) return false;
      line[at] = static_cast<char>('0' + below(rng, 10));
    } else if (kind == MutantKind::lost) {
      if (below(rng, 3) == 0)
        line.insert(at, 1, line[at]);
      else
        line.erase(at, 1);
    } else if (kind == MutantKind::sign) {
      flip_sign(line, n.begin);
    } else if (kind == MutantKind::scale) {
      move_point(line, n, rng);
    } else {
      const Number other = numbers[below(rng, numbers.size())];
      if (other.begin == n.begin) return false;
      const Number a = other.begin < n.begin ? other : n;
      const Number b = other.begin < n.begin ? n : other;
      const std::string first = line.substr(a.begin, a.size), second = line.substr(b.begin, b.size);
      line.replace(b.begin, b.size, first);
      line.replace(a.begin, a.size, second);
    }
    return true;
  }

  static void flip_sign(std::string& line, std::size_t at) {
    if (at > 0 && line[at - 1] == '-')
      line.erase(at - 1, 1);
    else if (at > 0 && line[at - 1] == '+')
      line[at - 1] = '-';
    else
      line.insert(at, 1, '-');
  }

  static void move_point(std::string& line, const Number& n, std::mt19937& rng) {
    std::string number = line.substr(n.begin, n.size);
    std::size_t point = number.find('.');
    if (point == std::string::npos) point = number.size();
    number.erase(std::remove(number.begin(), number.end(), '.'), number.end());
    if (below(rng, 2) == 0) {  // ten times as large
      if (++point > number.size()) number += '0';
    } else if (point == 0) {
      number.insert(0, 1, '0');
    } else {
      --point;
    }
    if (point < number.size()) number.insert(point, 1, '.');
    if (number.front() == '.') number.insert(0, 1, '0');
    line.replace(n.begin, n.size, number);
  }

  static bool change_axis(std::string& line, std::mt19937& rng) {
    static const std::string letters = "XYZABCUVWPRIJK";
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i + 1 < line.size(); ++i)
      if (letters.find(line[i]) != std::string::npos &&
          (is_digit(line[i + 1]) ||
           std::string_view("+-= .").find(line[i + 1]) != std::string::npos))
        places.push_back(i);
    if (places.empty()) return false;
    const std::size_t i = places[below(rng, places.size())];
    if (below(rng, 2) == 0) {
      line[i] = letters[below(rng, 9)];
      return true;
    }
    const std::size_t j = places[below(rng, places.size())];
    std::swap(line[i], line[j]);
    return true;
  }

  static bool drop_word(std::string& line, std::mt19937& rng) {
    std::vector<std::pair<std::size_t, std::size_t>> words;
    for (std::size_t i = 0; i < line.size();) {
      if (line[i] == ' ' || line[i] == ',' || line[i] == '\t') {
        ++i;
        continue;
      }
      const std::size_t begin = i;
      while (i < line.size() && line[i] != ' ' && line[i] != ',' && line[i] != '\t') ++i;
      words.emplace_back(begin, i - begin);
    }
    if (words.size() < 2) return false;
    const auto [begin, size] = words[below(rng, words.size())];
    const bool behind = begin + size < line.size();
    line.erase(begin, size + (behind ? 1 : 0));
    return true;
  }

  bool change_feed(std::vector<std::string>& lines, std::mt19937& rng) const {
    static const std::vector<std::string> marks = {
        "F",         "V=",     "v=",       "t=",    "a=",     "VEL.CP=",   "ORI1=",
        "ORI2=",     "tvel=",  "rvel=",    ".vel=", "VJ=",    "nanosec: ", " sec: ",
        "speeddata", "FINE ;", "VEL_PTP,", "P[",    "R[91]=", "mm/sec",    "V="};
    for (int attempt = 0; attempt < 30; ++attempt) {
      std::string& line = lines[some_line(rng)];
      const std::string& mark = marks[below(rng, marks.size())];
      const std::size_t at = line.rfind(mark);
      if (at == std::string::npos) continue;
      const bool before = mark == "mm/sec";
      const std::vector<Number> numbers = numbers_of(line);
      const Number* chosen = nullptr;
      for (const Number& n : numbers)
        if (before ? n.begin < at : n.begin >= at) {
          chosen = &n;
          if (!before) break;
        }
      if (chosen == nullptr) continue;
      static const std::array<const char*, 5> fronts = {"9", "99", "0.0", "0.", "1"};
      const std::string front = fronts[below(rng, fronts.size())];
      std::string number = line.substr(chosen->begin, chosen->size);
      if (front.find('.') != std::string::npos)
        number.erase(std::remove(number.begin(), number.end(), '.'), number.end());
      line.replace(chosen->begin, chosen->size, below(rng, 8) == 0 ? "0" : front + number);
      return true;
    }
    return false;
  }

  bool change_mode(std::vector<std::string>& lines, std::mt19937& rng) const {
    using Pair = std::pair<const char*, const char*>;
    static const std::vector<Pair> pairs = {{"G0 ", "G1 "},
                                            {"G1 ", "G0 "},
                                            {"G1 ", "G2 "},
                                            {"G2 ", "G3 "},
                                            {"G3 ", "G2 "},
                                            {"G2 ", "G1 "},
                                            {"G3 ", "G1 "},
                                            {"G17 G", "G19 G"},
                                            {"G18 G", "G17 G"},
                                            {"G19 G", "G18 G"},
                                            {" I", " K"},
                                            {" J", " K"},
                                            {"G91.1", "G90.1"},
                                            {"G162", "G161"},
                                            {"G90", "G91"},
                                            {"G21", "G20"},
                                            {"G17", "G18"},
                                            {"G93", "G94"},
                                            {"G94", "G93"},
                                            {"G94", "G95"},
                                            {"G61", "G64"},
                                            {"G60", "G64"},
                                            {"G54", "G55"},
                                            {"G40", "G41"},
                                            {"G49", "G43"},
                                            {"G53 ", ""},
                                            {"G43.4", "G43"},
                                            {"G43.4", "G43.5"},
                                            {"G43.5", "G43.4"},
                                            {"P1", "P2"},
                                            {"H1", "H2"},
                                            {"SUPA ", ""},
                                            {" D0", ""},
                                            {"D1", "D2"},
                                            {"G710", "G700"},
                                            {"G71", "G70"},
                                            {"G360", "G261"},
                                            {"G601", "G603"},
                                            {"TRAORI", "TRAFOOF"},
                                            {"TRAFOOF", "TRAORI"},
                                            {"ORIVECT", "ORIAXES"},
                                            {"ORIWKS", "ORIMKS"},
                                            {"RTLION", "RTLIOF"},
                                            {"STOPRE", ""},
                                            {"FMAX", "F100"},
                                            {" M91", ""},
                                            {" M91", " M92"},
                                            {"R0", "RL"},
                                            {"LN ", "L "},
                                            {"L ", "LN "},
                                            {"AXIS POS", "AXIS SPAT"},
                                            {"PATHCTRL VECTOR", "PATHCTRL AXIS"},
                                            {"F TCP", "F CONT"},
                                            {"RESET TCPM", "TCPM"},
                                            {" MM", " INCH"},
                                            {"LIN ", "PTP "},
                                            {"PTP ", "LIN "},
                                            {"LIN ", "LIN_REL "},
                                            {" C_DIS", " C_VEL"},
                                            {" C_DIS", ""},
                                            {"} ", "} C_DIS "},
                                            {"#BASE", "#TCP"},
                                            {"#VAR", "#CONSTANT"},
                                            {"MoveL", "MoveJ"},
                                            {"MoveAbsJ", "MoveJ"},
                                            {"MoveAbsJ", "MoveL"},
                                            {"fine", "z10"},
                                            {"fine", "spZ1"},
                                            {"ConfL\\Off", "ConfL\\On"},
                                            {"PDispOff", "PDispOn"},
                                            {"\\NoEOffs", ""},
                                            {"movel", "movej"},
                                            {"movej", "movel"},
                                            {"movep", "movel"},
                                            {"movel", "movep"},
                                            {"servoj", "movej"},
                                            {"pose_trans", "pose_add"},
                                            {"FINE", "CNT100"},
                                            {"FINE", "CR5"},
                                            {"L P[", "J P["},
                                            {"J P[", "L P["},
                                            {"mm/sec", "cm/min"},
                                            {"mm/sec", "deg/sec"},
                                            {"UFRAME_NUM=9", "UFRAME_NUM=8"},
                                            {"UTOOL_NUM=9", "UTOOL_NUM=8"},
                                            {"UF : 9", "UF : 8"},
                                            {"UT : 9", "UT : 8"},
                                            {"MOVL", "MOVJ"},
                                            {"MOVJ", "MOVL"},
                                            {"MOVL", "IMOV"},
                                            {"PL=0", "PL=3"},
                                            {"POSTYPE BASE", "POSTYPE ROBOT"},
                                            {"RECTAN", "PULSE"},
                                            {"TOOL 9", "TOOL 8"},
                                            {"blend=off", "blend=joint"},
                                            {"blend=off", "blend=cartesian"},
                                            {"'F U T", "'N U T"},
                                            {"'F U T", "'F D T"},
                                            {"ssame", "srighty"},
                                            {"wsame", "wnegative"},
                                            {"link(fPart,world)", "link(fPart,flange)"},
                                            {"world", "flange"},
                                            {"t=", "v="},
                                            {"v=", "t="},
                                            {"positions", "velocities"},
                                            {"#TRAFO OFF", "#TRAFO ON"},
                                            {"#HSC OFF", "#HSC ON"},
                                            {"M3 ", "M4 "},
                                            {"M3", "M5"},
                                            {"M5", "M3"},
                                            {"M8", "M9"},
                                            {"M9", "M8"},
                                            {"M80", "M81"},
                                            {"M81", "M80"},
                                            {"M62", "M63"},
                                            {"M63", "M62"},
                                            {"M62", "M64"},
                                            {"P0", "P1"},
                                            {"=ON", "=OFF"},
                                            {"=OFF", "=ON"},
                                            {"=TRUE", "=FALSE"},
                                            {"=FALSE", "=TRUE"},
                                            {"TRUE", "FALSE"},
                                            {"=true", "=false"},
                                            {"=false", "=true"},
                                            {"True", "False"},
                                            {"doCoolant,1", "doCoolant,0"},
                                            {"beam on", "beam off"},
                                            {"beam off", "beam on"},
                                            {"GT 0", "LT 0"},
                                            {"M30", ""},
                                            {"M2", ""},
                                            {"GOTO", "GOT"},
                                            {"H1 P1", "H1"},
                                            {"SC,RW", "SC"},
                                            {"1,*,*,*,*", "2,*,*,*,*"}};
    for (int attempt = 0; attempt < 400; ++attempt) {
      std::string& line = lines[some_line(rng)];
      const Pair& pair = pairs[below(rng, pairs.size())];
      const std::size_t at = line.find(pair.first);
      if (at == std::string::npos) continue;
      line.replace(at, std::string_view(pair.first).size(), pair.second);
      return true;
    }
    return false;
  }

  bool change_event(std::vector<std::string>& lines, std::mt19937& rng) const {
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < lines.size(); ++i)
      for (const auto& words : events_)
        if (lines[i].find(words) != std::string::npos) {
          places.push_back(i);
          break;
        }
    if (places.empty()) return false;
    const std::size_t i = places[below(rng, places.size())];
    const std::string line = lines[i];
    const std::size_t way = 1 + below(rng, 3);
    const auto here = lines.begin() + static_cast<std::ptrdiff_t>(i);
    switch (below(rng, 4)) {
      case 0:
        lines.erase(here);
        return true;
      case 1:  // once more, some lines on
        if (i + way > lines.size()) return false;
        lines.insert(here + static_cast<std::ptrdiff_t>(way), line);
        return true;
      case 2:
        if (i < way) return false;
        lines.erase(here);
        lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(i - way), line);
        return true;
      default:
        if (i + way >= lines.size()) return false;
        lines.erase(here);
        lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(i + way), line);
        return true;
    }
  }

  std::string text_;
  std::vector<std::string> lines_;
  std::vector<std::string> events_;
};

}  // namespace smoothpost::test

#include "formats/heidenhain/motion_words.h"

#include <algorithm>
#include <cmath>

namespace smoothpost::conversational {
namespace {

constexpr double kLargest = 1.0e6;  // of any word
constexpr int kLargestM = 999;
constexpr std::size_t kMostM = 8;

bool begins_value(char c) {
  return c == '+' || c == '-' || c == '.' || c == ',' || c == 'Q' || c == ' ' || c == '\t' ||
         (c >= '0' && c <= '9');
}

class WordReader {
 public:
  WordReader(Scanner& scanner, const Variables& variables, bool arc_radius, MotionWords& out)
      : scanner_(scanner), variables_(variables), arc_radius_(arc_radius), out_(out) {}

  std::optional<WordFault> run() {
    while (!fault_ && !scanner_.at_end()) read();
    if (!fault_ && out_.rapid && out_.feed) fail("NC404", "F and FMAX in one block");
    return fault_;
  }

 private:
  void fail(const char* code, std::string text) {
    if (!fault_) fault_ = WordFault{code, std::move(text), at_};
  }

  void read() {
    at_ = scanner_.offset();
    const char first = scanner_.peek();
    const char second = scanner_.peek(1);
    if (first == 'R') return read_r(second);
    if (first == 'F') return read_feed();
    if (first == 'M') return read_m();
    if (first == 'D' && second == 'R') return read_direction();
    if (first == 'S' && begins_value(second)) {
      scanner_.take_byte('S');
      out_.speed = value();
      if (!fault_ && *out_.speed < 0.0) fail("NC404", "S below 0");
      return;
    }
    if ((first == 'T' || first == 'N') && second >= 'X' && second <= 'Z')
      return read_vector(first, second);
    if (first == 'P' || (first == 'I' && second == 'P')) return read_polar();
    if (scanner_.take("LA")) {  // of M120, which changes no path of R0
      value();
      return;
    }
    read_axis();
  }

  double value() {
    const Value read = variables_.factor(scanner_);
    if (!read.ok()) {
      const bool unset = read.problem.find("has no value") != std::string::npos;
      at_ = read.offset;
      fail(unset ? "NC405" : "NC401", read.problem);
      return 0.0;
    }
    if (std::abs(read.value) > kLargest) fail("NC401", "a value beyond 1000000");
    return read.value;
  }

  void read_r(char second) {
    if (scanner_.take("RL") || scanner_.take("RR"))
      return fail("NC402",
                  "radius compensation (RL, RR) is not read: its path depends on the tool that is "
                  "mounted; let the CAM post write the tool's own path with R0");
    const char third = scanner_.peek(2);
    const bool none =
        second == '0' && third != '.' && third != ',' && !(third >= '0' && third <= '9');
    if (none || !arc_radius_) {
      if (none || second == '\0' || second == ' ') {
        scanner_.take_byte('R');
        scanner_.take_byte('0');
        return;
      }
      return fail("NC404", "`" + scanner_.token() + "` has no meaning in this block");
    }
    scanner_.take_byte('R');
    if (out_.radius) fail("NC404", "the word R stands twice");
    out_.radius = value();
  }

  void read_feed() {
    scanner_.take_byte('F');
    if (scanner_.take("MAX")) {
      out_.rapid = true;
      return;
    }
    if (scanner_.take("AUTO")) return;  // the feed of TOOL CALL, which is modal here
    if (scanner_.peek() == 'U' || scanner_.peek() == 'Z')
      return fail("NC402", "a feed by turn or tooth (FU, FZ) is not read; write F in mm/min");
    const double feed = value();
    // Behind M128 it is the largest feed of the motions that hold the tip.
    if (!out_.m.empty() && out_.m.back() == 128) return;
    if (out_.feed) fail("NC404", "the word F stands twice");
    if (!fault_ && feed <= 0.0) fail("NC404", "F needs a feed above 0");
    out_.feed = feed;
  }

  void read_m() {
    if (scanner_.peek(1) == 'B')
      return fail("NC402",
                  "M140 MB (retracting along the tool axis) is not read; let the CAM post "
                  "write the position");
    scanner_.take_byte('M');
    const double number = value();
    if (fault_) return;
    if (number < 0.0 || number > kLargestM || number != std::floor(number))
      return fail("NC401", "an M function is a whole number of 0 to 999");
    if (out_.m.size() == kMostM) return fail("NC404", "more than 8 M functions in one block");
    out_.m.push_back(static_cast<int>(number));
    out_.m_at.push_back(at_);
  }

  void read_direction() {
    scanner_.take_byte('D');
    scanner_.take_byte('R');
    const bool clockwise = scanner_.take_byte('-');
    if (!clockwise && !scanner_.take_byte('+')) return fail("NC401", "DR needs + or -");
    out_.clockwise = clockwise;
  }

  void read_vector(char first, char second) {
    scanner_.take_byte(first);
    scanner_.take_byte(second);
    const int axis = second - 'X';
    const double component = value();
    if (first == 'N') {
      out_.normal = true;
      return;
    }
    if ((out_.tool_words >> axis & 1U) != 0)
      fail("NC404", std::string("the word T") + second + " stands twice");
    out_.tool[axis] = component;
    out_.tool_words |= 1U << axis;
  }

  void read_polar() {
    const bool incremental = scanner_.take_byte('I');
    scanner_.take_byte('P');
    const bool angle = scanner_.take_byte('A');
    if (!angle && !scanner_.take_byte('R'))
      return fail("NC404", "`" + scanner_.token() + "` has no meaning in this block");
    auto& word = angle ? out_.polar_angle : out_.polar_radius;
    if (word) fail("NC404", "a polar word stands twice");
    word = value();
    (angle ? out_.angle_incremental : out_.radius_incremental) = incremental;
  }

  void read_axis() {
    const std::string token = scanner_.token();
    const bool incremental = scanner_.take_byte('I');
    const auto axis = kAxisLetters.find(scanner_.peek());
    if (axis == std::string_view::npos || !begins_value(scanner_.peek(1)))
      return fail("NC404", "`" + token + "` has no meaning in this block");
    scanner_.take_byte(kAxisLetters[axis]);
    const AxisMask bit = static_cast<AxisMask>(1U << axis);
    if ((out_.axes() & bit) != 0)
      fail("NC404", std::string("the word ") + kAxisLetters[axis] + " stands twice");
    out_.at[axis] = at_;
    out_.value[axis] = value();
    AxisMask& mask = incremental ? out_.incremental : out_.absolute;
    mask = static_cast<AxisMask>(mask | bit);
  }

  Scanner& scanner_;
  const Variables& variables_;
  bool arc_radius_;
  MotionWords& out_;
  std::size_t at_ = 0;
  std::optional<WordFault> fault_;
};

}  // namespace

bool MotionWords::has(int m_word) const { return std::find(m.begin(), m.end(), m_word) != m.end(); }

std::optional<WordFault> read_motion_words(Scanner& scanner, const Variables& variables,
                                           bool arc_radius, MotionWords& out) {
  return WordReader(scanner, variables, arc_radius, out).run();
}

}  // namespace smoothpost::conversational

#include "formats/heidenhain/executor.h"

#include <array>
#include <limits>

#include "kernels/core/units.h"

namespace smoothpost::conversational {
namespace {

/// Statements that move the tool or its coordinates in a way that is not read.
struct Refusal {
  std::string_view word;
  const char* reason;
};
constexpr std::array<Refusal, 24> kRefused = {{
    {"APPR", "approaches the contour of a compensated radius; let the CAM post write the motions"},
    {"DEP", "leaves the contour of a compensated radius; let the CAM post write the motions"},
    {"FL", "is free contour programming; let the CAM post write L and C"},
    {"FLT", "is free contour programming; let the CAM post write L and C"},
    {"FC", "is free contour programming; let the CAM post write L and C"},
    {"FCT", "is free contour programming; let the CAM post write L and C"},
    {"FPOL", "is free contour programming; let the CAM post write L and C"},
    {"FSELECT", "is free contour programming; let the CAM post write L and C"},
    {"CTP", "is a polar arc along a tangent; let the CAM post write C"},
    {"SPL", "is a spline; let the CAM post write L and C"},
    {"K", "is a coefficient of a spline; let the CAM post write L and C"},
    {"CALL PGM", "runs another file; put its blocks into this one"},
    {"SEL", "selects another file; put its blocks into this one"},
    {"CALL SELECTED", "runs another file; put its blocks into this one"},
    {"PGM CALL", "runs another file; put its blocks into this one"},
    {"TCH PROBE", "measures, and what it finds is known on the machine only"},
    {"PATTERN DEF", "is a pattern of holes; let the CAM post write them one by one"},
    {"CONTOUR DEF", "is a contour pocket; let the CAM post write its motions"},
    {"SEL CONTOUR", "is a contour pocket; let the CAM post write its motions"},
    {"CYCL CALL POS", "is not read; write the position as L with M99"},
    {"CYCL CALL PAT", "is a pattern of holes; let the CAM post write them one by one"},
    {"TRANS", "transforms coordinates; write CYCL DEF 7 or let the CAM post write positions"},
    {"PRESET", "changes presets; write CYCL DEF 247"},
    {"DECLARE", "is text of a running control"},
}};

constexpr std::array<std::string_view, 1> kNoEffect = {"BLK FORM"};

}  // namespace

Executor::Executor(std::string_view text, const std::string& file_name,
                   const nc::InterpreterSettings& settings, const nc::EventMatcher& matcher,
                   CanonicalSink& sink)
    : settings_(settings),
      matcher_(matcher),
      sink_(sink),
      log_(file_name),
      source_(text),
      coordinates_(settings) {}

Result<ReadingSummary> Executor::run() {
  find_labels();
  frames_.emplace_back();
  while (!stopped_ && next_ < source_.size()) step();
  finish();
  summary_.lines = source_.lines();
  if (log_.has_error()) return Result<ReadingSummary>::failure(log_.take());
  return {std::move(summary_), log_.take()};
}

void Executor::step() {
  at_ = next_;
  next_ = at_ + 1;
  if (at_ < farthest_) {
    if (!spend(1 + source_.length(at_) / 256)) return;
  } else {
    farthest_ = next_;
  }
  const Statement statement = source_.read(at_);
  if (!statement.text.empty()) {
    Scanner scanner(statement.text);
    execute(scanner);
  }
  if (!statement.comment.empty() && !stopped_)
    sink_.comment(statement.comment, source_.place(0).line);
}

bool Executor::spend(std::uint64_t amount) {
  spent_ += amount;
  if (spent_ <= settings_.run_budget) return true;
  error("NC408",
        "the program runs more than " + std::to_string(settings_.run_budget) +
            " blocks and strokes beyond its own length: it may never end; write loops out or "
            "shorten them",
        0);
  stopped_ = true;
  return false;
}

void Executor::execute(Scanner& scanner) {
  if (scanner.sees("BEGIN")) return begin_program(scanner);
  if (!begun_) {
    error("NC400", "the program has to begin with BEGIN PGM name MM (or INCH)", 0);
    begun_ = true;
  }
  for (const auto& [word, reason] : kRefused) {
    if (!scanner.sees(word)) continue;
    return error("NC402", std::string(word) + " is not read: it " + reason, 0);
  }
  if (execute_motion(scanner) || execute_other(scanner)) return;
  error("NC403", "`" + scanner.token() + "` begins no block that is known here", scanner.offset());
}

bool Executor::execute_motion(Scanner& scanner) {
  if (scanner.take("L")) return line(scanner, false), true;
  if (scanner.take("LN")) return line(scanner, true), true;
  if (scanner.take("CC")) return pole(scanner), true;
  if (scanner.take("C")) return circle(scanner), true;
  if (scanner.take("CR")) return radius_circle(scanner), true;
  if (scanner.take("CT")) return tangent_circle(scanner), true;
  if (scanner.take("CP")) return polar_circle(scanner), true;
  if (scanner.take("LP")) return polar_line(scanner), true;
  if (scanner.take("RND")) return corner(scanner, false), true;
  if (scanner.take("CHF")) return corner(scanner, true), true;
  return false;
}

bool Executor::execute_other(Scanner& scanner) {
  for (const auto word : kNoEffect)
    if (scanner.sees(word)) return true;
  if (scanner.take("END")) return end_program(scanner), true;
  if (scanner.take("TOOL DEF")) {
    const auto tool = scanner.whole();
    if (tool && !scanner.at_end())
      warn_once(tool_data, "NC416",
                "TOOL DEF: its length counts from a zero tool of the control and is not taken; "
                "lengths are those of --tool N=LENGTH (first of such lines)",
                0);
    return true;
  }
  if (scanner.take("TOOL CALL")) return tool_call(scanner), true;
  if (scanner.take("CYCL DEF") || scanner.take("CYCLE DEF")) return define_cycle(scanner), true;
  if (scanner.take("CYCL CALL")) {
    const std::size_t offset = scanner.offset();
    const auto read = words(scanner);
    if (!read) return true;
    if (read->axes() != 0 || read->rapid || read->feed) {
      error("NC404", "CYCL CALL takes M functions only", offset);
      return true;
    }
    apply_functions(*read, false);
    drill(0);
    apply_functions(*read, true);
    return true;
  }
  if (scanner.take("LBL")) return label(scanner), true;
  if (scanner.take("CALL LBL")) return call_label(scanner), true;
  if (scanner.take("FN")) return function(scanner), true;
  if (scanner.take("FUNCTION")) return tcpm(scanner), true;
  if (scanner.take("PLANE")) return plane(scanner), true;
  if (scanner.take("STOP")) return stop(scanner), true;
  if (scanner.sees("IF")) return condition(scanner, 0), true;
  if (scanner.peek() == 'M') return functions(scanner), true;
  if (scanner.peek() == 'Q') return assign(scanner), true;
  return false;
}

void Executor::begin_program(Scanner& scanner) {
  if (begun_) return error("NC400", "a second BEGIN PGM: one program stands in one file", 0);
  begun_ = true;
  scanner.take("BEGIN");
  if (!scanner.take("PGM"))
    return error("NC400", "the program has to begin with BEGIN PGM name MM (or INCH)", 0);
  name_ = scanner.rest();
  const auto ends_in = [&](std::string_view unit) {
    return name_.size() > unit.size() && name_.substr(name_.size() - unit.size()) == unit;
  };
  if (ends_in(" INCH")) {
    unit_ = kMillimetresPerInch;
  } else if (!ends_in(" MM")) {
    error("NC400", "BEGIN PGM does not say the unit: write BEGIN PGM name MM (or INCH)", 0);
  }
}

void Executor::end_program(Scanner& scanner) {
  if (!scanner.take("PGM")) return error("NC403", "`END` begins no block that is known here", 0);
  if (scanner.rest() != name_)
    log_.warning("NC415", "END PGM has another name or unit than BEGIN PGM", source_.place(0));
  if (frames_.size() > 1)
    error("NC407", "the program ends within a subprogram: LBL 0 is missing", 0);
  end_run();
}

/// M2, M30 or END PGM.
void Executor::end_run() {
  send_held(nullptr);
  if (!summary_.ended) sink_.program_end(source_.place(0).line);
  summary_.ended = true;
  stopped_ = true;
}

void Executor::finish() {
  if (!begun_) log_.error("NC400", "the file contains no BEGIN PGM", {1, 1});
  if (stopped_) return;
  send_held(nullptr);
  log_.warning("NC415", "the text ends without END PGM or M30: it may be cut short",
               {source_.lines(), 1});
}

/// Words up to the end of the block; nothing after a fault.
std::optional<MotionWords> Executor::words(Scanner& scanner, bool arc_radius) {
  MotionWords out;
  if (const auto fault = read_motion_words(scanner, variables_, arc_radius, out)) {
    error(fault->code, fault->text, fault->offset);
    return {};
  }
  return usable(out) ? std::optional(out) : std::nullopt;
}

/// Whether the input's machine has the axes.
bool Executor::usable(const MotionWords& words) {
  bool good = true;
  for (std::size_t i = 0; i < words.value.size(); ++i) {
    const auto bit = static_cast<AxisMask>(1U << i);
    if ((words.axes() & bit) == 0) continue;
    const bool rotary = i >= 3 && i < 6;
    if (rotary && tcp_ && by_spatial_angles_) continue;
    std::string problem;
    if (rotary && settings_.any_axis_needs_machine)
      problem =
          " is a position of a rotary axis: say which machine the program was posted for "
          "(--input-machine)";
    else if ((settings_.axes & bit) == 0)
      problem = " is an axis that the input's machine does not have";
    if (problem.empty()) continue;
    error("NC412", "the word " + std::string(1, kAxisLetters[i]) + problem, words.at[i]);
    good = false;
  }
  return good;
}

bool Executor::no_more(Scanner& scanner) {
  if (scanner.at_end()) return true;
  error("NC404", "`" + scanner.token() + "` has no meaning in this block", scanner.offset());
  return false;
}

std::optional<double> Executor::value(Scanner& scanner) {
  const Value read = variables_.factor(scanner);
  if (read.ok()) return read.value;
  error("NC405", read.problem, read.offset);
  return {};
}

void Executor::error(const char* code, std::string text, std::size_t offset) {
  log_.error(code, std::move(text), source_.place(offset));
}

void Executor::warn_once(Once which, const char* code, std::string text, std::size_t offset) {
  if ((told_ & which) != 0) return;
  told_ |= which;
  log_.warning(code, std::move(text), source_.place(offset));
}

Result<ReadingSummary> read(std::string_view text, const std::string& file_name,
                            const nc::InterpreterSettings& settings, CanonicalSink& sink) {
  if (text.size() >= std::numeric_limits<std::uint32_t>::max()) {
    nc::DiagnosticLog log(file_name);
    log.error("NC400", "the file is larger than 4 GB", {1, 1});
    return Result<ReadingSummary>::failure(log.take());
  }
  auto matcher = nc::EventMatcher::compile(settings.process);
  if (!matcher.ok()) return Result<ReadingSummary>::failure(matcher.diagnostics());
  return Executor(text, file_name, settings, matcher.value(), sink).run();
}

}  // namespace smoothpost::conversational

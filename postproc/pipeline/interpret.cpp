#include "postproc/pipeline/interpret.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "formats/csv/cutter_locations.h"
#include "formats/heidenhain/reader.h"
#include "formats/nc/dialect_detection.h"
#include "formats/nc/program_stream.h"
#include "kernels/core/units.h"
#include "postproc/pipeline/canonical_record.h"
#include "postproc/pipeline/hash.h"

namespace smoothpost {

namespace {

constexpr AxisMask kXyz = 0x7;
constexpr AxisMask kRotary = 0x38;

std::string words_text(AxisMask mask) {
  std::string text;
  for (int i = 0; i < kAxisWords; ++i)
    if (mask >> i & 1U)
      text += (text.empty() ? "" : " ") + std::string(1, kAxisLetters[static_cast<std::size_t>(i)]);
  return text;
}

/// Turns recorded calls into path points and events.
class PathBuilder {
 public:
  PathBuilder(CanonicalRecord& recorder, const InputSettings& settings)
      : recorder_(recorder), settings_(settings) {}

  Result<InterpretedInput> run() {
    survey();
    if (recorder_.motions.empty()) fail("NC311", 0, "the program contains no motion");
    if (!has_error(diagnostics_)) build();
    if (has_error(diagnostics_)) return Result<InterpretedInput>::failure(std::move(diagnostics_));
    describe();
    return Result<InterpretedInput>(std::move(out_), std::move(diagnostics_));
  }

 private:
  // Which words matter, which systems are used, where the last cut ends.
  void survey() {
    for (std::size_t i = 0; i < recorder_.motions.size(); ++i) {
      const auto& m = recorder_.motions[i];
      programmed_ |= m.programmed;
      if (m.synchronised && !has_error(diagnostics_))
        fail("NC316", m.line,
             "this motion follows the turning of the spindle (a thread, a rigid tap, a feed by the "
             "turn; first of such motions), which no output of this version does: let the CAM post "
             "write feeds by time, or keep this operation on its control",
             m.column);
      if (m.probe && !has_error(diagnostics_))
        fail("NC317", m.line,
             "this motion is a probe's (G38.2 to G38.5; first of such motions): it stops where the "
             "probe touches, so that its end and what follows are not known before it runs: keep "
             "probing in a program of its own on its control",
             m.column);
      if (m.kind == MotionKind::feed) last_feed_ = i + 1;
      if (m.tcp)
        uses_tcp_ = true;
      else
        uses_joints_ = true;
    }
    programmed_ |= kXyz;
    for (const auto& s : recorder_.states)
      if (s.system == 0 && s.length != 0.0) compensates_ = true;
    for (std::size_t i = last_feed_; i < recorder_.motions.size(); ++i)
      if (recorder_.motions[i].machine_position) {
        end_ = i;
        break;
      }
    end_ = std::min(end_, recorder_.motions.size());
  }

  void build() {
    if (settings_.machine) out_.frames.input_machine = settings_.machine;
    for (const auto& step : recorder_.steps) {
      add_motions(step.motions_before);
      if (has_error(diagnostics_)) return;
      switch (step.kind) {
        case CanonicalRecord::Step::Kind::tool:
          set_tool(recorder_.states[step.index]);
          break;
        case CanonicalRecord::Step::Kind::offset:
          set_offset(recorder_.states[step.index]);
          break;
        case CanonicalRecord::Step::Kind::event:
          add_event(recorder_.events[step.index]);
          break;
      }
      if (has_error(diagnostics_)) return;
    }
    add_motions(recorder_.motions.size());
    if (has_error(diagnostics_)) return;
    if (out_.path.points.empty())
      fail("NC312", recorder_.motions.front().line,
           "no motion of the program starts from a known position: " + words_text(programmed_) +
               " are never all programmed");
  }

  /// The next ones, before motion `end`.
  void add_motions(std::size_t end) {
    for (; next_ < end && !has_error(diagnostics_); ++next_) {
      if (next_ < end_)
        add_motion(next_);
      else
        skipped_end_.push_back(recorder_.motions[next_].line);
    }
  }

  void set_tool(const CanonicalRecord::State& state) {
    compensation_ = state.length;
    if (state.tool > 0) tool_in_use(state.tool);
    // G43.1 states a length itself, with or without a tool number.
    if (state.length != 0.0 && !settings_.tool_lengths.contains(state.tool))
      tool_length_ = state.length;
  }

  void tool_in_use(int tool) {
    out_.uses_tools = true;
    tool_ = tool;
    const auto known = settings_.tool_lengths.find(tool);
    tool_length_ = known == settings_.tool_lengths.end() ? 0.0 : known->second;
  }

  void set_offset(const CanonicalRecord::State& state) {
    if (!world_set_) {
      out_.frames.world_from_part = Pose::Identity();
      out_.frames.world_from_part.linear() = rotation_about(Vec3::UnitZ(), state.rotation);
      out_.frames.world_from_part.translation() = state.origin;
      first_system_ = state.system;
      world_set_ = true;
      return;
    }
    if (state.system != first_system_ && !settings_.work_offsets.contains(state.system) &&
        state.origin == Vec3::Zero() && !other_systems_.contains(state.system)) {
      other_systems_.insert({state.system, state.line});
      fail("PR301", state.line,
           "work offset system " + system_name(state.system) + " is used besides " +
               system_name(first_system_) +
               " and where it lies is not known: give --input-work-offset " +
               system_name(state.system) + "=x,y,z (and that of " + system_name(first_system_) +
               ")");
    }
  }

  void add_event(const PathEvent& event) {
    PathEvent e = event;
    e.before_start = out_.path.points.empty();
    e.point = e.before_start ? 0 : out_.path.points.size() - 1;
    if (e.kind == PathEvent::Kind::process) {
      if (e.event.name == event_name::kBeamOn || e.event.name == event_name::kPierce) beam_ = true;
      if (e.event.name == event_name::kBeamOff) beam_ = false;
      if (e.event.name == event_name::kToolChange) {
        for (auto& [key, value] : e.event.parameters) {
          if (key != "tool") continue;
          const auto number = settings_.tool_numbers.find(value);
          if (number != settings_.tool_numbers.end()) value = std::to_string(number->second);
          tool_in_use(std::atoi(value.c_str()));
        }
      }
    }
    out_.path.events.push_back(std::move(e));
  }

  void add_motion(std::size_t index) {
    const CanonicalRecord::Motion& motion = recorder_.motions[index];
    // With the tool axis as a vector the rotary bits say whether that is unknown.
    const AxisMask counts =
        motion.axis_vector ? static_cast<AxisMask>(programmed_ | kRotary) : programmed_;
    const AxisMask lacking_start = motion.unknown_start & counts;
    const AxisMask lacking_end = motion.unknown_end & counts;
    if (motion.kind == MotionKind::feed && lacking_start != 0) {
      fail("NC313", motion.line,
           "a feed motion starts where the position of " + words_text(lacking_start) +
               " is unknown: program a rapid move to a full position before it",
           motion.column);
      return;
    }
    if (lacking_end != 0 || motion.machine_position) {
      lost_ = true;
      lost_lines_.push_back(motion.line);
      return;
    }
    if (!world_set_) world_set_ = true;
    PathPoint point = make_point(motion);
    if (out_.path.points.empty()) {
      point.kind = MotionKind::rapid;
      point.is_arc = false;
      first_line_ = motion.line;
      if (lacking_start == 0 && motion.unknown_start == 0)
        add_start_point(recorder_.start_of(index), point, motion.axis_vector);
      if (lacking_start != 0) lost_lines_.push_back(motion.line);
    } else if (lost_) {
      point.replanned = true;
      point.is_arc = false;
      point.arc = -1;
    }
    lost_ = false;
    push(std::move(point));
  }

  PathPoint make_point(const CanonicalRecord::Motion& motion) {
    PathPoint point;
    point.kind = motion.kind;
    point.interpolation =
        motion.tcp ? PathInterpolation::rotary_linear : PathInterpolation::joint_linear;
    point.beam = beam_;
    point.line = motion.line;
    point.duration = motion.duration;
    point.words = motion.end;
    point.compensation = compensation_;
    point.tool = tool_;
    point.tool_length = tool_length_;
    // A program that never compensates describes the tip itself; one that does is at the holder's
    // reference until it compensates.
    point.tip_offset = compensates_ ? tool_length_ - compensation_ : 0.0;
    if (motion.axis_vector)
      set_location(point, motion.end, axis_of(motion.end_axis, motion.end, point));
    if (motion.arc >= 0) {
      point.is_arc = true;
      point.arc = static_cast<std::int32_t>(out_.path.arcs.size());
      out_.path.arcs.push_back(recorder_.arcs[static_cast<std::size_t>(motion.arc)]);
    }
    return point;
  }

  /// The frames are settled once the first motion is there.
  const ReferencePath& reference() {
    if (!reference_) reference_.emplace(out_.path, out_.frames);
    return *reference_;
  }

  /// The tool axis in world coordinates: as given, else the input machine's at the rotary words.
  Vec3 axis_of(const Vec3& given, const AxisWords& words, const PathPoint& like) {
    if (!given.isZero(0.0)) return given;
    return out_.frames.world_from_part.linear() * reference().location_of_words(words, like).axis;
  }

  void set_location(PathPoint& point, const AxisWords& words, const Vec3& axis) const {
    const Pose part_from_world = out_.frames.world_from_part.inverse();
    point.interpolation = PathInterpolation::great_circle;
    point.location.axis = (part_from_world.linear() * axis).normalized();
    point.location.tip = part_from_world * Vec3(words[0], words[1], words[2]) -
                         point.tip_offset * point.location.axis;
  }

  // A program whose first motion starts at a known place (an earlier lost motion ended there).
  void add_start_point(const CanonicalRecord::Start& from, const PathPoint& like,
                       bool axis_vector) {
    PathPoint start = like;
    start.words = from.words;
    if (axis_vector) {
      start.interpolation = PathInterpolation::rotary_linear;
      set_location(start, from.words, axis_of(from.axis, from.words, start));
    }
    start.is_arc = false;
    start.arc = -1;
    start.duration = 0.0;
    out_.path.points.push_back(start);
  }

  // The tip at `words` as the controller reads them for `like`.
  Vec3 tip_of(const AxisWords& words, const PathPoint& like) {
    if (like.interpolation == PathInterpolation::great_circle)
      return out_.frames.world_from_part.inverse() * Vec3(words[0], words[1], words[2]) -
             like.tip_offset * like.location.axis;
    return reference().location_of_words(words, like).tip;
  }

  void push(PathPoint point) {
    if (!out_.path.points.empty() && !point.replanned) {
      const PathPoint& last = out_.path.points.back();
      const bool same_state =
          last.compensation == point.compensation && last.tip_offset == point.tip_offset &&
          last.tool_length == point.tool_length && last.interpolation == point.interpolation;
      if (!same_state) {
        // The controller changed its reading of the words here: a rapid across that place is ours
        // to plan; a cut across it would start with a jump of the tip.
        if (point.kind == MotionKind::feed) {
          const Vec3 before = tip_of(last.words, last);
          const Vec3 after = tip_of(last.words, point);
          if ((before - after).norm() > 1e-6) {
            fail("NC314", point.line,
                 "a feed motion starts right after the tool length or TCP mode changed, where the "
                 "tip "
                 "jumps by " +
                     std::to_string((before - after).norm()) +
                     " mm: program a rapid move between them");
            return;
          }
        }
        point.replanned = point.kind == MotionKind::rapid;
      }
    }
    out_.path.points.push_back(std::move(point));
  }

  void describe() {
    out_.system = first_system_;
    ReferencePath reference(out_.path, out_.frames);
    for (auto& point : out_.path.points) {
      if (point.interpolation == PathInterpolation::great_circle)
        uses_vectors_ = true;
      else
        point.location = reference.location_of_words(point.words, point);
    }
    auto& assumes = out_.assumes;
    if (settings_.machine)
      assumes.push_back("the input was posted for machine " + settings_.machine->name);
    if (!compensates_ && out_.uses_tools)
      assumes.push_back("the program never activates a tool length: its coordinates are the tip's");
    std::vector<std::uint32_t> unmapped;
    for (const auto& e : out_.path.events)
      if (e.kind == PathEvent::Kind::comment && e.text.rfind("unmapped: ", 0) == 0)
        unmapped.push_back(e.line);
    if (!unmapped.empty())
      assumes.push_back(
          "words without a mapping are comments that do nothing, on the user's word: lines " +
          line_list(unmapped));
    if (!lost_lines_.empty()) {
      note("the way to the first full position (up to line " + std::to_string(first_line_) +
           ") and over machine positions is re-planned: input lines " + line_list(lost_lines_));
    }
    if (!skipped_end_.empty())
      note(
          "the motions to machine positions at the end are replaced by the end of the output "
          "program: input lines " +
          line_list(skipped_end_));
    if (uses_joints_ && settings_.machine && !settings_.work_offsets.contains(first_system_))
      assumes.push_back(
          "outside TCP mode the program's zero lies at the input machine's zero (no "
          "--input-work-offset given)");
    out_.reference =
        uses_vectors_ ? "tool axis by vectors: tip on lines and arcs, tool axis on great circles" +
                            std::string(uses_joints_ ? "; outside it all joints linear" : "")
        : uses_tcp_ && uses_joints_ ? "TCP mode: tip on lines and arcs, rotary joints linear; "
                                      "outside it all joints linear"
        : uses_tcp_ ? "tip on lines and arcs, rotary joints of the input machine linear"
                    : "joints of the input machine linear, arcs in XYZ";
  }

  static std::string line_list(std::vector<std::uint32_t> lines) {
    std::sort(lines.begin(), lines.end());
    lines.erase(std::unique(lines.begin(), lines.end()), lines.end());
    std::string text;
    for (std::size_t i = 0; i < lines.size() && i < 8; ++i)
      text += (i ? ", " : "") + std::to_string(lines[i]);
    if (lines.size() > 8) text += " and " + std::to_string(lines.size() - 8) + " more";
    return text;
  }

  static std::string system_name(int system) {
    if (system <= 6) return "G" + std::to_string(53 + system);
    return "G59." + std::to_string(system - 6);
  }

  void note(std::string text) {
    Diagnostic d;
    d.severity = Severity::note;
    d.code = "NC310";
    d.text = std::move(text);
    d.where.file = settings_.file_name;
    diagnostics_.push_back(std::move(d));
  }

  void fail(const char* code, std::uint32_t line, std::string text, std::uint32_t column = 0) {
    Diagnostic d;
    d.code = code;
    d.text = std::move(text);
    d.where = {settings_.file_name, static_cast<int>(line), static_cast<int>(column)};
    diagnostics_.push_back(std::move(d));
  }

  CanonicalRecord& recorder_;
  const InputSettings& settings_;
  InterpretedInput out_;
  std::optional<ReferencePath> reference_;
  Diagnostics diagnostics_;
  AxisMask programmed_ = 0;
  std::size_t next_ = 0;  ///< motion that is added next
  std::size_t last_feed_ = 0;
  std::size_t end_ = static_cast<std::size_t>(-1);
  bool uses_tcp_ = false;
  bool uses_joints_ = false;
  bool uses_vectors_ = false;
  bool compensates_ = false;
  bool world_set_ = false;
  int first_system_ = 1;
  std::map<int, std::uint32_t> other_systems_;
  double compensation_ = 0.0;
  int tool_ = 0;
  double tool_length_ = 0.0;
  bool beam_ = false;
  bool lost_ = false;
  std::uint32_t first_line_ = 0;
  std::vector<std::uint32_t> lost_lines_;
  std::vector<std::uint32_t> skipped_end_;
};

nc::InterpreterSettings interpreter_settings(const InputSettings& settings) {
  nc::InterpreterSettings s;
  s.tool_lengths = settings.tool_lengths;
  s.tool_diameters = settings.tool_diameters;
  s.integer_increment = settings.integer_unit;
  s.subroutine_folders = settings.subroutine_folders;
  s.run_budget = settings.run_budget.value_or(s.run_budget);
  s.call_depth = settings.call_depth.value_or(s.call_depth);
  s.work_offsets = settings.work_offsets;
  if (settings.machine) {
    s.axes = 0;
    for (const auto& axis : settings.machine->axes) {
      const auto w = kAxisLetters.find(axis.letter);
      if (w == std::string_view::npos) continue;
      s.axes |= static_cast<AxisMask>(1U << w);
      s.home[w] = axis.joint.home;
    }
    s.inch_default = settings.machine->dialect.units == "inch";
    s.process = settings.machine->process;
  } else {
    s.axes = kXyz | kRotary;
    s.any_axis_needs_machine = true;
  }
  if (settings.process) s.process = *settings.process;
  return s;
}

}  // namespace

std::string dialect_name(nc::InputDialect dialect) {
  switch (dialect) {
    case nc::InputDialect::linuxcnc:
      return "linuxcnc";
    case nc::InputDialect::fanuc:
      return "fanuc";
    case nc::InputDialect::haas:
      return "haas";
    case nc::InputDialect::siemens:
      return "siemens";
  }
  return "linuxcnc";
}

std::optional<nc::InputDialect> input_dialect(std::string_view name) {
  for (const auto dialect : {nc::InputDialect::linuxcnc, nc::InputDialect::fanuc,
                             nc::InputDialect::haas, nc::InputDialect::siemens})
    if (name == dialect_name(dialect)) return dialect;
  return {};
}

namespace {

std::string dialect_list(const std::vector<nc::InputDialect>& dialects) {
  std::string text;
  for (const auto dialect : dialects) text += (text.empty() ? "" : ", ") + dialect_name(dialect);
  return text;
}

/// The dialect that the user named, or the only one whose marks stand in the text.
Result<nc::InputDialect> dialect_of(const std::string& text, const InputSettings& settings) {
  if (settings.dialect) return Result<nc::InputDialect>(*settings.dialect);
  Diagnostic d;
  d.where.file = settings.file_name;
  const auto fitting = nc::fitting_dialects(text);
  if (fitting.size() > 1) {
    d.code = "US149";
    d.text = "the program has marks of several dialects (" + dialect_list(fitting) +
             "): say which one it is with --input-dialect";
    return Result<nc::InputDialect>::failure(d);
  }
  if (fitting.empty()) return Result<nc::InputDialect>(nc::InputDialect::linuxcnc);
  if (fitting.front() == nc::InputDialect::linuxcnc)
    return Result<nc::InputDialect>(nc::InputDialect::linuxcnc);
  d.severity = Severity::note;
  d.code = "NC315";
  d.text = "read as dialect " + dialect_name(fitting.front()) +
           ", the only one whose words stand in it (--input-dialect says another)";
  return Result<nc::InputDialect>(fitting.front(), {d});
}

}  // namespace

Result<InterpretedInput> interpret_nc(std::string text, const InputSettings& settings) {
  if (!settings.dialect && nc::is_heidenhain(text)) {
    auto read = interpret_heidenhain(std::move(text), settings);
    if (!read.ok()) return read;
    Diagnostic d;
    d.severity = Severity::note;
    d.code = "NC315";
    d.text =
        "read as dialect heidenhain: BEGIN PGM stands at its head (--input-dialect says another)";
    d.where.file = settings.file_name;
    Diagnostics diagnostics = {d};
    diagnostics.insert(diagnostics.end(), read.diagnostics().begin(), read.diagnostics().end());
    return Result<InterpretedInput>(std::move(read.value()), std::move(diagnostics));
  }
  const auto dialect = dialect_of(text, settings);
  if (!dialect.ok()) return Result<InterpretedInput>::failure(dialect.diagnostics());
  CanonicalRecord recorder;
  nc::ProgramStream::Hooks hooks;
  hooks.restart = [&] { recorder = {}; };
  std::optional<nc::ProgramStream> program;
  program.emplace(std::move(text), settings.file_name, dialect.value(), hooks);
  const auto summary = nc::interpret(*program, interpreter_settings(settings), recorder);
  if (has_error(program->diagnostics()))
    return Result<InterpretedInput>::failure(program->diagnostics());
  Diagnostics diagnostics = dialect.diagnostics();
  diagnostics.insert(diagnostics.end(), program->diagnostics().begin(),
                     program->diagnostics().end());
  diagnostics.insert(diagnostics.end(), summary.diagnostics().begin(), summary.diagnostics().end());
  if (!summary.ok()) return Result<InterpretedInput>::failure(std::move(diagnostics));
  const std::size_t lines = program->program().block_count;
  program.reset();  // the text and its pieces have been read
  auto built = PathBuilder(recorder, settings).run();
  diagnostics.insert(diagnostics.end(), built.diagnostics().begin(), built.diagnostics().end());
  if (!built.ok()) return Result<InterpretedInput>::failure(std::move(diagnostics));
  built.value().lines = lines;
  built.value().dialect = dialect_name(dialect.value());
  for (const auto& file : summary.value().files)
    built.value().files.push_back({file.name, sha256(file.text), file.path});
  return Result<InterpretedInput>(std::move(built.value()), std::move(diagnostics));
}

namespace {

/// The path of what a reader with a summary of its own called.
template <typename Summary>
Result<InterpretedInput> built_path(CanonicalRecord& recorder, const InputSettings& settings,
                                    const Summary& summary, Diagnostics diagnostics,
                                    const char* dialect) {
  auto built = PathBuilder(recorder, settings).run();
  diagnostics.insert(diagnostics.end(), built.diagnostics().begin(), built.diagnostics().end());
  if (!built.ok()) return Result<InterpretedInput>::failure(std::move(diagnostics));
  built.value().lines = summary.lines;
  built.value().dialect = dialect;
  for (const auto& assumed : summary.assumes) built.value().assumes.push_back(assumed);
  return Result<InterpretedInput>(std::move(built.value()), std::move(diagnostics));
}

}  // namespace

Result<InterpretedInput> interpret_heidenhain(std::string text, const InputSettings& settings) {
  nc::InterpreterSettings reader = interpreter_settings(settings);
  reader.inch_default = false;  // the text says its unit
  CanonicalRecord recorder;
  const auto summary = conversational::read(text, settings.file_name, reader, recorder);
  if (!summary.ok()) return Result<InterpretedInput>::failure(summary.diagnostics());
  return built_path(recorder, settings, summary.value(), summary.diagnostics(), "heidenhain");
}

Result<InterpretedInput> interpret_cl(std::string text, const InputSettings& settings) {
  cl::ReaderSettings reader = settings.cl;
  if (settings.machine) reader.process = settings.machine->process;
  if (settings.process) reader.process = *settings.process;
  CanonicalRecord recorder;
  const auto summary = cl::read(text, settings.file_name, reader, recorder);
  if (!summary.ok()) return Result<InterpretedInput>::failure(summary.diagnostics());
  return built_path(recorder, settings, summary.value(), summary.diagnostics(), "");
}

Result<InterpretedInput> interpret_csv(std::string text, const InputSettings& settings) {
  const std::size_t lines = static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  auto read = read_cutter_locations(text, settings.file_name);
  if (!read.ok()) return Result<InterpretedInput>::failure(read.diagnostics());
  InterpretedInput input;
  input.path = std::move(read.value());
  input.reference = input.path.full_pose
                        ? "tip on straight lines, rotation about one fixed axis a row (slerp)"
                        : "tip on straight lines, tool axis on great circles";
  input.lines = lines;
  return Result<InterpretedInput>(std::move(input), read.diagnostics());
}

}  // namespace smoothpost

#pragma once

#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "formats/heidenhain/corner.h"
#include "formats/heidenhain/cycles.h"
#include "formats/heidenhain/motion_words.h"
#include "formats/heidenhain/reader.h"
#include "formats/heidenhain/source.h"
#include "formats/heidenhain/variables.h"
#include "formats/nc/arc.h"
#include "formats/nc/coordinates.h"
#include "formats/nc/event_words.h"

namespace smoothpost::conversational {

/// Whether an M function acts at the end of its block.
bool acts_late(int m);

/// Runs the blocks of one program. Dispatch and flow stand in executor.cpp and execute_flow.cpp,
/// straight motion in execute_motion.cpp, arcs and corners in execute_arcs.cpp, tool-centre-point
/// modes and planes in execute_planes.cpp, cycles in execute_cycles.cpp, tools and M functions in
/// execute_process.cpp.
class Executor {
 public:
  Executor(std::string_view text, const std::string& file_name,
           const nc::InterpreterSettings& settings, const nc::EventMatcher& matcher,
           CanonicalSink& sink);
  Result<ReadingSummary> run();

 private:
  /// Messages that are told once, as bits.
  enum Once : unsigned {
    tool_data = 1,
    no_length = 2,
    contour_feed = 4,
    path_of_vectors = 8,
    feed_functions = 16
  };

  // Flow.
  void find_labels();
  bool take_label(Scanner& scanner, std::string& label);
  void step();
  bool spend(std::uint64_t amount);
  void execute(Scanner& scanner);
  bool execute_motion(Scanner& scanner);
  bool execute_other(Scanner& scanner);
  void begin_program(Scanner& scanner);
  void end_program(Scanner& scanner);
  void finish();
  void end_run();
  void label(Scanner& scanner);
  void call_label(Scanner& scanner);
  void function(Scanner& scanner);
  void condition(Scanner& scanner, int number);
  void assign(Scanner& scanner);
  std::optional<std::size_t> target_of(Scanner& scanner);

  // Words.
  std::optional<MotionWords> words(Scanner& scanner, bool arc_radius = false);
  bool usable(const MotionWords& words);
  bool no_more(Scanner& scanner);

  // Motion.
  void line(Scanner& scanner, bool vector);
  void polar_line(Scanner& scanner);
  void pole(Scanner& scanner);
  void circle(Scanner& scanner);
  void polar_circle(Scanner& scanner);
  void radius_circle(Scanner& scanner);
  void tangent_circle(Scanner& scanner);
  void corner(Scanner& scanner, bool chamfer);
  bool corner_follows();
  void line_to(const MotionWords& words);
  std::optional<nc::PlanePoint> polar_end(const MotionWords& words);
  void arc_to(const MotionWords& words, const nc::PlaneArc& arc);
  bool arc_start(const MotionWords& words);
  nc::ArcWords arc_words(const MotionWords& words, bool clockwise) const;
  AxisWords target(const MotionWords& words) const;
  AxisMask unknown_at(const MotionWords& words) const;
  void machine_line(const MotionWords& words);
  CanonicalMotion begin_motion(const MotionWords& words);
  bool set_axis(const MotionWords& words, CanonicalMotion& motion);
  bool set_speed(const MotionWords& words, CanonicalMotion& motion, double xyz_length);
  double length_speed(double feed) const;
  void send(const CanonicalMotion& motion);
  void hold(const CanonicalMotion& motion);
  void send_held(CanonicalMotion* next);

  // Tool-centre-point modes and planes.
  void tcpm(Scanner& scanner);
  void set_tcp(bool on);
  /// Rotary words are spatial angles.
  bool spatial_words() const { return tcp_ && by_spatial_angles_; }
  Vec3 spatial_axis(const MotionWords& words);
  void plane(Scanner& scanner);
  std::optional<bool> plane_behaviour(Scanner& scanner);
  void set_plane(const std::optional<Mat3>& rotation);
  void set_frame(const Mat3& rotation);

  // Cycles.
  void define_cycle(Scanner& scanner);
  void define_part(Scanner& scanner, int cycle, int part);
  void datum_shift(Scanner& scanner);
  void datum_rotation(Scanner& scanner);
  void dwell_part(Scanner& scanner);
  void peck_part(Scanner& scanner, int part);
  void parameter_cycle(Scanner& scanner, int cycle);
  void drill(std::size_t offset);
  std::optional<double> value(Scanner& scanner);

  // Process.
  void tool_call(Scanner& scanner);
  void change_tool(const std::string& name, long number);
  void functions(Scanner& scanner);
  void stop(Scanner& scanner);
  void apply_functions(const MotionWords& words, bool after);
  void apply_function(int m, std::size_t offset, const MotionWords& words);
  bool function_row(int m, std::size_t offset, const MotionWords& words);
  void spindle(int m, const nc::EventRow* row);
  void event(const char* name, nc::EventParameters parameters = {});

  void error(const char* code, std::string text, std::size_t offset);
  void warn_once(Once which, const char* code, std::string text, std::size_t offset);

  const nc::InterpreterSettings& settings_;
  const nc::EventMatcher& matcher_;
  CanonicalSink& sink_;
  nc::DiagnosticLog log_;
  Source source_;
  Variables variables_;
  ReadingSummary summary_;

  // Flow.
  struct Frame {
    std::size_t back = 0;                           ///< the block behind the call
    std::unordered_map<std::size_t, long> repeats;  ///< by CALL LBL REP: how often still
  };
  std::unordered_map<std::string, std::size_t> labels_;
  std::vector<Frame> frames_;
  std::size_t at_ = 0;        ///< the block that runs
  std::size_t next_ = 0;      ///< the one behind
  std::size_t farthest_ = 0;  ///< no block from here on has run
  bool has_corners_ = false;  ///< RND or CHF stands in the text
  std::uint64_t spent_ = 0;
  bool stopped_ = false;
  bool begun_ = false;
  std::string name_;   ///< of BEGIN PGM, with its unit
  double unit_ = 1.0;  ///< mm

  // Motion.
  nc::Coordinates coordinates_;
  Vec3 axis_ = Vec3::Zero();  ///< the tool axis in world coordinates, when it is known by a vector
  bool by_vector_ = false;
  AxisMask rotary_named_ = 0;  ///< rotary axes that the program has given a position
  bool tcp_ = false;
  bool by_spatial_angles_ = false;
  bool great_circles_ = false;   ///< PATHCTRL VECTOR
  Vec3 spatial_ = Vec3::Zero();  ///< A B C of AXIS SPAT, rad
  bool tilted_ = false;          ///< a tilted plane is active
  bool stale_plane_ = false;     ///< the rotary axes stand as a plane that is off left them
  bool nearest_turn_ = false;    ///< M126
  std::optional<double> feed_;   ///< F as written
  Vec3 pole_ = Vec3::Zero();     ///< CC, program coordinates, mm
  unsigned pole_known_ = 0;      ///< bit 0: X, bit 1: Y
  std::optional<Vec3> way_;      ///< direction of the last motion at its end, program coordinates
  struct Held {
    CanonicalMotion motion;
    bool corner = false;  ///< RND or CHF was read
    bool chamfer = false;
    double size = 0.0;
    std::optional<double> feed;
    nc::TextPlace place;
  };
  std::optional<Held> held_;  ///< a line that waits for what the next one makes of its corner
  bool offset_told_ = false;

  // Cycles.
  int cycle_ = -1;  ///< of the CYCL DEF that is being read
  bool cycle_refused_ = false;
  AxisWords shift_{};      ///< datum shift, mm and rad
  double rotation_ = 0.0;  ///< rad, of cycle 10
  DrillCycle drill_;
  bool drill_defined_ = false;

  // Process.
  nc::ModalWords modal_;
  long tool_ = -1;
  std::string tool_name_;
  bool radius_delta_ = false;
  int spindle_ = 5;
  const nc::EventRow* spindle_row_ = nullptr;
  unsigned told_ = 0;
};

}  // namespace smoothpost::conversational

#pragma once

#include <array>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>

#include "formats/cl/arc.h"
#include "formats/cl/cycle.h"
#include "formats/cl/event_rows.h"
#include "formats/cl/feed.h"
#include "formats/cl/reader.h"
#include "formats/cl/statement.h"

namespace smoothpost::cl {

/// Runs the statements of one text. Dispatch and modes stand in executor.cpp, motion in
/// execute_motion.cpp, arcs in execute_arcs.cpp, cycles in execute_cycle.cpp, tools, spindle and
/// texts in execute_process.cpp, frames in execute_frames.cpp.
class Executor {
 public:
  Executor(std::string_view text, const std::string& file_name, const ReaderSettings& settings,
           CanonicalSink& sink);
  Result<ReadingSummary> run();

 private:
  /// Messages that are told once, as bits.
  enum Once : unsigned {
    no_unit = 1,
    no_feed = 2,
    long_axis = 4,
    compensation = 8,
    world_frame = 16,
    frame_note = 32,
    tool_not_loaded = 64,
    unit_assumed = 128,
    feed_assumed = 256
  };

  struct Position {
    Vec3 tip = Vec3::Zero();
    Vec3 axis = Vec3::UnitZ();
  };

  bool is_binary();
  void execute(const Statement& statement);
  void act(const Statement& statement);
  void act_on_mode(const Statement& statement);
  void finish();
  bool note_after_end(const Statement& statement);

  // Modes.
  void set_units(const Statement& statement);
  void set_multax(const Statement& statement);
  void set_tool_axis(const Statement& statement);
  void set_feed(const Statement& statement);

  // Motion.
  void go_to(const Statement& statement);
  void from(const Statement& statement);
  void go_delta(const Statement& statement);
  std::optional<Position> target(const Statement& statement);
  std::optional<Vec3> unit_direction(std::size_t first, const char* what, TextPlace place);
  std::optional<Vec3> tool_axis(const Statement& statement, std::size_t first);
  std::optional<double> speed(std::optional<Feed> own, TextPlace place);
  void line_to(const Position& end, MotionKind kind, std::optional<Feed> own, TextPlace place);
  CanonicalMotion begin_motion(const Position& end, TextPlace place) const;
  void reach(const Position& end);
  void lose(const Statement& statement);

  // Arcs.
  void begin_circle(const Statement& statement);
  void forward_direction(const Statement& statement);
  void tlon(const Statement& statement);
  struct TlonArc {
    Circle circle;
    Vec3 end = Vec3::Zero();
    bool plane_given = false;
  };
  std::optional<TlonArc> read_tlon(const Statement& statement);
  std::string choose_plane(TlonArc& arc) const;
  void arc_point(const Position& point, TextPlace place);
  void arc_values(const Statement& statement);
  void finish_arc();
  std::optional<bool> nx_right_hand(TextPlace place);
  void circle_without_end(TextPlace place);

  // Cycles.
  void cycle(const Statement& statement);
  void hole(const Position& mouth, TextPlace place);

  // Process.
  void spindle(const Statement& statement);
  void emit_spindle(const Statement& statement);
  void load_tool(const Statement& statement, std::size_t first);
  void load(const Statement& statement);
  void select(const Statement& statement);
  void describe_tool(const Statement& statement);
  void coolant(const Statement& statement);
  void cutter_compensation(const Statement& statement);
  void dwell(const Statement& statement);
  void insert(const Statement& statement);
  bool act_on_row(const Statement& statement);
  void event(const char* name, const Statement& statement,
             std::vector<std::pair<std::string, std::string>> parameters = {});
  void unmapped(const Statement& statement);
  void comment(std::string_view text, TextPlace place);

  // Frames.
  void frame_by_axes(const Statement& statement);
  void frame_by_matrix(const Statement& statement);
  void transformation_type(const Statement& statement);
  void comment_statement(const Statement& statement);
  void catia_row(std::string_view text, TextPlace place);
  void first_frame(const char* what, TextPlace place);
  void set_frame(const char* what, const Mat3& rotation, const Vec3& origin, TextPlace place);
  Vec3 point(std::size_t first) const;
  Vec3 direction(std::size_t first) const;

  // Values of the present statement.
  bool read_numbers(const Statement& statement, std::initializer_list<std::size_t> counts,
                    const char* form);
  bool numbers_from(std::span<const Item> items, const char* form);
  bool length_unit(TextPlace place);
  bool in_range(const Vec3& tip, TextPlace place);
  bool only_word(const Statement& statement, std::string_view& word, const char* form);
  void error(const char* code, std::string text, TextPlace place);
  bool once(Once which);

  static constexpr std::size_t kMostNumbers = 16;

  const ReaderSettings& settings_;
  CanonicalSink& sink_;
  DiagnosticLog log_;
  std::string_view text_;
  Scanner scanner_;
  EventRows rows_;
  ReadingSummary summary_;

  std::array<double, kMostNumbers> numbers_{};
  std::size_t count_ = 0;

  // What the text has said so far.
  std::optional<double> unit_;
  std::optional<Feed> feed_;
  bool unit_given_ = false;  ///< by the text
  bool feed_given_ = false;
  Position position_;
  bool known_ = false;        ///< the position is known
  bool doubtful_ = false;     ///< a motion was refused: the position is not the text's
  bool rapid_ = false;        ///< RAPID waits for its motion
  bool locked_axis_ = false;  ///< MULTAX/OFF

  std::optional<Circle> circle_;  ///< waits for its GOTO
  TextPlace circle_place_;
  struct OpenArc {
    ArcPath path;
    Vec3 end_axis;
    TextPlace place;
  };
  std::optional<OpenArc> arc_;
  std::optional<Vec3> forward_;  ///< INDIRV, unit
  std::optional<bool> nx_right_hand_;

  std::optional<Cycle> cycle_;
  std::optional<Cycle> last_cycle_;
  bool cycle_refused_ = false;  ///< a cycle that could not be read is on
  Position before_cycle_;
  bool known_before_cycle_ = false;

  double rpm_ = 0.0;
  bool spindle_on_ = false;
  bool spindle_reverse_ = false;
  long described_tool_ = -1;  ///< of TOOLNO, not loaded yet

  bool frame_given_ = false;
  bool world_points_ = false;  ///< TRNTYP/WORLD: coordinates are not in the frame
  Mat3 frame_rotation_ = Mat3::Identity();
  Vec3 frame_origin_ = Vec3::Zero();  ///< in the text's unit
  bool move_points_ = false;          ///< coordinates go through the frame
  int catia_lines_ = -1;              ///< comment lines since $$*CATIA0; -1: none is read
  int catia_rows_ = 0;
  Mat3 catia_rotation_ = Mat3::Identity();
  Vec3 catia_origin_ = Vec3::Zero();

  bool path_ended_ = false;  ///< the last statement was END-OF-PATH
  unsigned told_ = 0;        ///< bits of once()
};

}  // namespace smoothpost::cl

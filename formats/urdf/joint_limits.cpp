#include <yaml.h>

#include <cmath>

#include "formats/urdf/urdf.h"
#include "kernels/core/signed_number.h"

namespace smoothpost::urdf {

namespace {

constexpr std::size_t kDeepest = 16;
constexpr std::size_t kMostJoints = 2000;
constexpr double kLargest = 1e9;

/// One `has_X: true` and `max_X: 1` of a joint, before they are put together.
struct Quantity {
  std::optional<bool> has;
  std::optional<double> lowest, highest;
};
struct RawLimits {
  std::string joint;
  int line = 0;
  Quantity position, velocity, acceleration, jerk;
};

class Reader {
 public:
  explicit Reader(const std::string& file) : file_(file) {}

  Result<std::vector<NamedYamlLimits>> read(std::string_view text) {
    using Out = Result<std::vector<NamedYamlLimits>>;
    if (text.size() > kMaxBytes)
      error("MF201", "the file is larger than 16 MiB: is it a joint_limits.yaml?", 0);
    else
      events(text);
    if (!has_error(diagnostics_) && joints_.empty())
      error("MF203", "no joint below a key joint_limits", 0);
    if (has_error(diagnostics_)) return Out::failure(std::move(diagnostics_));
    std::vector<NamedYamlLimits> out;
    for (const RawLimits& raw : joints_) out.push_back(put_together(raw));
    if (has_error(diagnostics_)) return Out::failure(std::move(diagnostics_));
    return out;
  }

 private:
  void error(const char* code, std::string text, std::size_t line) {
    constexpr std::size_t kMost = 50;
    if (diagnostics_.size() < kMost)
      diagnostics_.push_back(
          {Severity::error, code, std::move(text), {file_, static_cast<int>(line), 0}});
  }

  void events(std::string_view text) {
    yaml_parser_t parser;
    if (yaml_parser_initialize(&parser) == 0) return error("MF201", "not read: memory", 0);
    yaml_parser_set_input_string(&parser, reinterpret_cast<const unsigned char*>(text.data()),
                                 text.size());
    bool more = true;
    while (more) {
      yaml_event_t event;
      if (yaml_parser_parse(&parser, &event) == 0) {
        error("MF201", "not YAML: " + std::string(parser.problem == nullptr ? "?" : parser.problem),
              parser.problem_mark.line + 1);
        break;
      }
      more = event.type != YAML_STREAM_END_EVENT && take(event);
      yaml_event_delete(&event);
    }
    yaml_parser_delete(&parser);
  }

  /// False: nothing more is to be read.
  bool take(const yaml_event_t& event) {
    const std::size_t line = event.start_mark.line + 1;
    switch (event.type) {
      case YAML_ALIAS_EVENT:
        error("MF202", "an alias (*name) is not read: write the values out", line);
        return false;
      case YAML_MAPPING_START_EVENT:
      case YAML_SEQUENCE_START_EVENT:
        if (path_.size() >= kDeepest) {
          error("MF201", "the file nests deeper than 16", line);
          return false;
        }
        path_.push_back({event.type == YAML_MAPPING_START_EVENT, key_});
        if (in_joint() && path_.size() == joint_depth_ + 2) {
          if (joints_.size() >= kMostJoints) {
            error("MF201", "more than 2000 joints", line);
            return false;
          }
          joints_.push_back({key_, static_cast<int>(line), {}, {}, {}, {}});
        }
        key_.clear();
        waiting_ = false;
        return true;
      case YAML_MAPPING_END_EVENT:
      case YAML_SEQUENCE_END_EVENT:
        path_.pop_back();
        if (path_.size() <= joint_depth_) joint_depth_ = kNowhere;
        waiting_ = false;
        return true;
      case YAML_SCALAR_EVENT:
        return scalar(event, line);
      default:
        return true;
    }
  }

  bool in_joint() {
    if (joint_depth_ == kNowhere && path_.back().mapping && path_.back().key == "joint_limits")
      joint_depth_ = path_.size() - 1;
    return joint_depth_ != kNowhere;
  }

  bool scalar(const yaml_event_t& event, std::size_t line) {
    const std::string text(reinterpret_cast<const char*>(event.data.scalar.value),
                           std::min<std::size_t>(event.data.scalar.length, 256));
    if (path_.empty() || !path_.back().mapping) return true;
    if (!waiting_) {
      key_ = text;
      waiting_ = true;
      return true;
    }
    waiting_ = false;
    if (joint_depth_ == kNowhere || path_.size() != joint_depth_ + 2) return true;
    if (event.data.scalar.tag != nullptr) {
      error("MF202",
            key_ + ": the tag " +
                std::string(reinterpret_cast<const char*>(event.data.scalar.tag)).substr(0, 64) +
                " is not read: write the number in rad or m",
            line);
      return false;
    }
    value(joints_.back(), text, line);
    return true;
  }

  static Quantity* quantity(RawLimits& raw, std::string_view name) {
    if (name == "position") return &raw.position;
    if (name == "velocity") return &raw.velocity;
    if (name == "acceleration") return &raw.acceleration;
    if (name == "jerk") return &raw.jerk;
    return nullptr;
  }

  void value(RawLimits& raw, const std::string& text, std::size_t line) {
    const std::string_view key = key_;
    constexpr std::string_view kHas = "has_", kLimits = "_limits";
    if (key.size() > kHas.size() + kLimits.size() && key.substr(0, 4) == kHas &&
        key.substr(key.size() - kLimits.size()) == kLimits) {
      Quantity* q =
          quantity(raw, key.substr(kHas.size(), key.size() - kHas.size() - kLimits.size()));
      if (q == nullptr) return;
      if (text == "true" || text == "True")
        q->has = true;
      else if (text == "false" || text == "False")
        q->has = false;
      else
        error("MF203", raw.joint + ": " + key_ + " is \"" + text + "\", not true or false", line);
      return;
    }
    const bool lowest = key.substr(0, 4) == "min_";
    if (!lowest && key.substr(0, 4) != "max_") return;
    Quantity* q = quantity(raw, key.substr(4));
    if (q == nullptr) return;
    double number = 0.0;
    const auto [end, fault] = from_signed(text, number);
    if (fault != std::errc() || end != text.data() + text.size() || !(std::abs(number) <= kLargest))
      error("MF203", raw.joint + ": " + key_ + " is \"" + text + "\", not a number", line);
    (lowest ? q->lowest : q->highest) = number + 0.0;
  }

  NamedYamlLimits put_together(const RawLimits& raw) {
    NamedYamlLimits out{raw.joint, {}};
    out.limits.line = raw.line;
    const auto positive = [&](const char* name, const Quantity& q) -> std::optional<double> {
      if (!q.highest || q.has == false) return std::nullopt;
      if (*q.highest > 0.0) return q.highest;
      error("MF203", raw.joint + ": max_" + name + " is not above 0",
            static_cast<std::size_t>(raw.line));
      return std::nullopt;
    };
    out.limits.velocity = positive("velocity", raw.velocity);
    out.limits.acceleration = positive("acceleration", raw.acceleration);
    out.limits.jerk = positive("jerk", raw.jerk);
    if (raw.position.has != false) {
      out.limits.lower = raw.position.lowest;
      out.limits.upper = raw.position.highest;
    }
    return out;
  }

  /// A mapping or list that is open, and the key that it is the value of.
  struct Level {
    bool mapping = false;
    std::string key;
  };
  static constexpr std::size_t kNowhere = static_cast<std::size_t>(-2);
  std::string file_;
  std::vector<Level> path_;
  std::string key_;
  bool waiting_ = false;                ///< for the value of key_
  std::size_t joint_depth_ = kNowhere;  ///< index of the level joint_limits
  std::vector<RawLimits> joints_;
  Diagnostics diagnostics_;
};

}  // namespace

Result<std::vector<NamedYamlLimits>> read_joint_limits(std::string_view text,
                                                       const std::string& file) {
  return Reader(file).read(text);
}

}  // namespace smoothpost::urdf

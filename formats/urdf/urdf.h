#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/core/result.h"

// Robot descriptions of ROS: links and the joints between them, as written (metre, radian).
namespace smoothpost::urdf {

struct Link {
  std::string name;
  std::vector<std::string> collision;  ///< in words: "mesh FILE", "box", "cylinder", "sphere"
  int line = 0;
};

struct Limits {
  std::optional<double> lower;     ///< rad or m
  std::optional<double> upper;     ///< rad or m
  std::optional<double> velocity;  ///< per s
};

struct Joint {
  std::string name;
  std::string type;  ///< revolute | continuous | prismatic | fixed | floating | planar
  std::string parent;
  std::string child;
  std::array<double, 3> xyz{};          ///< of the child's frame in the parent's, m
  std::array<double, 3> rpy{};          ///< Rz(y)·Ry(p)·Rx(r), rad
  std::array<double, 3> axis{1, 0, 0};  ///< in the child's frame, any length above 0
  Limits limits;
  std::string mimics;  ///< name of the joint that this one follows; empty: none
  int line = 0;
};

struct Robot {
  std::string name;
  std::vector<Link> links;
  std::vector<Joint> joints;  ///< a tree: every child has one parent, one link is no child
  std::string root;           ///< that link
};

inline constexpr std::size_t kMaxBytes = std::size_t{16} << 20;
inline constexpr std::size_t kMaxElements = 2000;  ///< links, and joints

/// Reads a URDF. Text that is no XML, nests deeper than the XML reader goes, or is larger than
/// kMaxBytes: MF201. xacro that is not expanded, and a joint type that does not exist: MF202. A
/// number that is missing or none: MF203. Links that are not one tree: MF204.
/// Cost: linear; the text is held once more as a tree of elements.
Result<Robot> read_urdf(std::string_view text, const std::string& file);

/// What a joint_limits.yaml says of one joint; only what its has_..._limits switches on.
struct YamlLimits {
  std::optional<double> lower, upper, velocity, acceleration, jerk;
  int line = 0;
};
struct NamedYamlLimits {
  std::string joint;
  YamlLimits limits;
};

/// Reads a joint_limits.yaml as MoveIt and ros2_control have it: joint_limits: JOINT:
/// max_velocity ... at any depth of mappings. Other keys are left alone. MF201: no YAML, or larger
/// than kMaxBytes or deeper than 16 mappings; MF202: aliases and tags (`!degrees`); MF203: values.
/// Order of the file.   Cost: linear.
Result<std::vector<NamedYamlLimits>> read_joint_limits(std::string_view text,
                                                       const std::string& file);

}  // namespace smoothpost::urdf

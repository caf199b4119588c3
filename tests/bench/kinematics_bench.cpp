#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "kernels/kinematics/branch_tracking.h"
#include "kernels/kinematics/numeric_ik.h"
#include "kernels/kinematics/rotary_pair.h"
#include "kernels/kinematics/screw_chain.h"
#include "kernels/kinematics/six_r.h"
#include "machines/definition/machine_file.h"
#include "tests/kernels/kinematics/reference_machines.h"
#ifdef SMOOTHPOST_WITH_KDL
#include <kdl/chain.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainiksolverpos_lma.hpp>
#include <kdl/chainiksolverpos_nr_jl.hpp>
#include <kdl/chainiksolvervel_pinv.hpp>
#endif

// Kinematics of a five-axis machine beside its floor: the libm calls that the same work cannot do
// without, measured in the same run. Counters: ns of
// processor time per call and of the floor, and their ratio.
namespace smoothpost {
namespace {

constexpr std::size_t kPoses = 4096;  // a power of two; small enough for the second-level cache

/// Elementary functions that a computation needs.
struct Calls {
  int sine_cosine = 0;  ///< pairs
  int atan2 = 0;
  int sqrt = 0;
};

/// Processor time of this process in ns: other programs on the machine do not count.
double processor_ns() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e9 * static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec);
}

/// Least of nine measurements of those calls alone, on arguments that change from call to call.
double floor_ns(const Calls& calls) {
  std::vector<double> arguments(kPoses);
  test::Random random(51);
  for (double& a : arguments) a = random.between(0.1, 3.0);
  double best = 1e300;
  for (int repeat = 0; repeat < 9; ++repeat) {
    const double start = processor_ns();
    double sum = 0.0;
    for (std::size_t i = 0; i < kPoses; ++i) {
      double a = arguments[i];
      for (int k = 0; k < calls.sine_cosine; ++k) {
        sum += std::sin(a) + std::cos(a);
        a += 0.01;
      }
      for (int k = 0; k < calls.atan2; ++k) {
        sum += std::atan2(a, 1.7 - a);
        a += 0.01;
      }
      for (int k = 0; k < calls.sqrt; ++k) {
        sum += std::sqrt(a);
        a += 0.01;
      }
    }
    benchmark::DoNotOptimize(sum);
    best = std::min(best, (processor_ns() - start) / static_cast<double>(kPoses));
  }
  return best;
}

/// Runs `work(i)` as the benchmark and reports it beside its floor.
template <typename Work>
void beside_floor(benchmark::State& state, const Calls& calls, const Work& work) {
  const double floor = floor_ns(calls);
  std::size_t i = 0;
  const double start = processor_ns();
  for (auto _ : state) {
    work(i);
    i = (i + 1) % kPoses;
  }
  const double each = (processor_ns() - start) / static_cast<double>(state.iterations());
  state.counters["ns"] = each;
  state.counters["floor_ns"] = floor;
  state.counters["ratio"] = each / floor;
}

ScrewChain chain_by(std::int64_t index) {
  return index == 0   ? test::table_table_ac()
         : index == 1 ? test::laser(200.0)
                      : test::table_table_b45c();
}

const char* name_by(std::int64_t index) {
  return index == 0 ? "table_table_AC" : index == 1 ? "laser_5p1" : "table_table_B45C";
}

struct Poses {
  ScrewChain chain;
  std::vector<JointVector> q;
  std::vector<CutterLocation> location;
};

Poses poses_of(std::int64_t index) {
  Poses poses{chain_by(index), {}, {}};
  test::Random random(52);
  for (std::size_t i = 0; i < kPoses; ++i) {
    poses.q.push_back(random.joints(poses.chain));
    poses.location.push_back(forward_location(poses.chain, poses.q.back()));
  }
  return poses;
}

void closed_form_both_branches(benchmark::State& state) {
  const Poses poses = poses_of(state.range(0));
  const auto pair = RotaryPair::from(poses.chain);
  state.SetLabel(name_by(state.range(0)));
  beside_floor(state, {.sine_cosine = 0, .atan2 = 3, .sqrt = 6}, [&](std::size_t i) {
    benchmark::DoNotOptimize(pair->solve(poses.location[i], poses.q[i]));
  });
}
BENCHMARK(closed_form_both_branches)->DenseRange(0, 2);

void forward_pose(benchmark::State& state) {
  const Poses poses = poses_of(state.range(0));
  state.SetLabel(name_by(state.range(0)));
  beside_floor(state, {.sine_cosine = 2},
               [&](std::size_t i) { benchmark::DoNotOptimize(forward(poses.chain, poses.q[i])); });
}
BENCHMARK(forward_pose)->DenseRange(0, 1);

void forward_location_only(benchmark::State& state) {
  const Poses poses = poses_of(state.range(0));
  state.SetLabel(name_by(state.range(0)));
  beside_floor(state, {.sine_cosine = 2}, [&](std::size_t i) {
    benchmark::DoNotOptimize(forward_location(poses.chain, poses.q[i]));
  });
}
BENCHMARK(forward_location_only)->DenseRange(0, 1);

void geometric_jacobian(benchmark::State& state) {
  const Poses poses = poses_of(state.range(0));
  state.SetLabel(name_by(state.range(0)));
  beside_floor(state, {.sine_cosine = 2},
               [&](std::size_t i) { benchmark::DoNotOptimize(jacobian(poses.chain, poses.q[i])); });
}
BENCHMARK(geometric_jacobian)->DenseRange(0, 1);

void curvature_bound(benchmark::State& state) {
  const Poses poses = poses_of(state.range(0));
  state.SetLabel(name_by(state.range(0)));
  std::vector<JointVector> to;
  for (std::size_t i = 0; i < kPoses; ++i) to.push_back(poses.q[i] * 0.999);
  beside_floor(state, {.sine_cosine = 2, .sqrt = 12}, [&](std::size_t i) {
    benchmark::DoNotOptimize(second_derivative_bound(poses.chain, poses.q[i], to[i]));
  });
}
BENCHMARK(curvature_bound)->DenseRange(0, 1);

/// The shipped robot at random poses, and starts 0.05 rad off.
struct RobotPoses {
  ScrewChain chain;
  std::vector<JointVector> q;
  std::vector<JointVector> start;
  std::vector<Pose> pose;
  std::vector<CutterLocation> location;
};

RobotPoses robot_poses() {
  std::ifstream file(SMOOTHPOST_SOURCE_DIR "/machines/robot_6r/machine.toml");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  RobotPoses poses{chain_of(parse_machine_file(text, "robot_6r").value(), 100.0), {}, {}, {}, {}};
  test::Random random(53);
  for (std::size_t i = 0; i < kPoses; ++i) {
    const JointVector q = random.joints(poses.chain);
    JointVector start = q;
    for (int j = 0; j < 6; ++j)
      start[j] = std::clamp(q[j] + random.between(-0.05, 0.05), poses.chain.joints[j].lower,
                            poses.chain.joints[j].upper);
    poses.q.push_back(q);
    poses.start.push_back(start);
    poses.pose.push_back(forward(poses.chain, q));
    poses.location.push_back(forward_location(poses.chain, q));
  }
  return poses;
}

void robot_all_eight_branches(benchmark::State& state) {
  const RobotPoses poses = robot_poses();
  const auto arm = SixR::from(poses.chain);
  beside_floor(state, {.sine_cosine = 0, .atan2 = 20, .sqrt = 9}, [&](std::size_t i) {
    benchmark::DoNotOptimize(arm->solve(poses.pose[i], poses.q[i]));
  });
  state.counters["six_sincos_ns"] = floor_ns({.sine_cosine = 6});
}
BENCHMARK(robot_all_eight_branches);

void robot_forward_pose(benchmark::State& state) {
  const RobotPoses poses = robot_poses();
  beside_floor(state, {.sine_cosine = 6},
               [&](std::size_t i) { benchmark::DoNotOptimize(forward(poses.chain, poses.q[i])); });
}
BENCHMARK(robot_forward_pose);

void robot_jacobian(benchmark::State& state) {
  const RobotPoses poses = robot_poses();
  beside_floor(state, {.sine_cosine = 6},
               [&](std::size_t i) { benchmark::DoNotOptimize(jacobian(poses.chain, poses.q[i])); });
}
BENCHMARK(robot_jacobian);

/// Argument 0: pose, 1: tip and axis. `failed` of 4096, `steps` on average.
void numeric_inverse_warm(benchmark::State& state) {
  const RobotPoses poses = robot_poses();
  const bool by_pose = state.range(0) == 0;
  state.SetLabel(by_pose ? "pose" : "tip and axis");
  const auto solve = [&](std::size_t i) {
    return by_pose ? numeric_inverse(poses.chain, poses.pose[i], poses.start[i])
                   : numeric_inverse(poses.chain, poses.location[i], poses.start[i]);
  };
  int failed = 0;
  int steps = 0;
  for (std::size_t i = 0; i < kPoses; ++i) {
    const NumericInverse found = solve(i);
    failed += found.status == NumericInverse::Status::ok ? 0 : 1;
    steps += found.iterations;
  }
  beside_floor(state, {.sine_cosine = 6},
               [&](std::size_t i) { benchmark::DoNotOptimize(solve(i)); });
  state.counters["failed"] = failed;
  state.counters["steps"] = static_cast<double>(steps) / kPoses;
}
BENCHMARK(numeric_inverse_warm)->DenseRange(0, 1);

#ifdef SMOOTHPOST_WITH_KDL
/// The peer: the same robot, poses and starts in Orocos KDL.
KDL::Chain kdl_chain(const ScrewChain& chain) {
  const auto vector = [](const Vec3& v) { return KDL::Vector(v.x(), v.y(), v.z()); };
  KDL::Chain out;
  Vec3 at = Vec3::Zero();
  for (int j = 0; j < chain.size(); ++j) {
    const ChainJoint& joint = chain.joints[j];
    const Vec3 next =
        j + 1 < chain.size() ? chain.joints[j + 1].origin : Vec3(chain.tool_home.translation());
    // A KDL segment is its joint, then a frame; both are in the frame of the segment before.
    out.addSegment(KDL::Segment(
        KDL::Joint(vector(joint.origin - at), vector(joint.direction), KDL::Joint::RotAxis),
        KDL::Frame(vector(next - at))));
    at = next;
  }
  return out;
}

/// Argument 0: LMA, 1: NR_JL with the pseudo-inverse; both to 1e-9.
void kdl_inverse_warm(benchmark::State& state) {
  const RobotPoses poses = robot_poses();
  state.SetLabel(state.range(0) == 0 ? "KDL LMA" : "KDL NR_JL");
  const KDL::Chain chain = kdl_chain(poses.chain);
  KDL::ChainFkSolverPos_recursive fk(chain);
  KDL::ChainIkSolverVel_pinv velocity(chain);
  KDL::JntArray lower(6);
  KDL::JntArray upper(6);
  std::vector<KDL::JntArray> start(kPoses, KDL::JntArray(6));
  std::vector<KDL::Frame> target(kPoses);
  for (int j = 0; j < 6; ++j) {
    lower(j) = poses.chain.joints[j].lower;
    upper(j) = poses.chain.joints[j].upper;
  }
  for (std::size_t i = 0; i < kPoses; ++i) {
    KDL::JntArray q(6);
    for (int j = 0; j < 6; ++j) {
      start[i](j) = poses.start[i][j];
      q(j) = poses.q[i][j];
    }
    fk.JntToCart(q, target[i]);
  }
  Eigen::Matrix<double, 6, 1> weight;  // mm first, then rad as 100 mm
  weight << 1, 1, 1, 100, 100, 100;
  KDL::ChainIkSolverPos_LMA lma(chain, weight, 1e-9);
  KDL::ChainIkSolverPos_NR_JL newton(chain, lower, upper, fk, velocity, 100, 1e-9);
  KDL::JntArray out(6);
  const auto solve = [&](std::size_t i) {
    return state.range(0) == 0 ? lma.CartToJnt(start[i], target[i], out)
                               : newton.CartToJnt(start[i], target[i], out);
  };
  int failed = 0;
  for (std::size_t i = 0; i < kPoses; ++i) failed += solve(i) < 0 ? 1 : 0;
  beside_floor(state, {.sine_cosine = 6},
               [&](std::size_t i) { benchmark::DoNotOptimize(solve(i)); });
  state.counters["failed"] = failed;
}
BENCHMARK(kdl_inverse_warm)->DenseRange(0, 1);
#endif

/// Tilted rings, one a hundred points, joined by links; every fifth ring starts with an upright
/// stretch.
std::vector<TrackingPoint> rings(std::size_t count) {
  std::vector<TrackingPoint> points;
  points.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    TrackingPoint p;
    const double azimuth = 2.0 * M_PI * static_cast<double>(i % 100) / 100.0;
    const double tilt = (i / 100) % 5 == 0 && i % 100 < 20 ? 0.0 : 0.4;
    p.location.tip =
        Vec3(40.0 * std::cos(azimuth), 40.0 * std::sin(azimuth), 0.01 * double(i % 1000));
    p.location.axis = Vec3(std::sin(tilt) * std::cos(azimuth), std::sin(tilt) * std::sin(azimuth),
                           std::cos(tilt));
    p.cut = i % 100 != 0;
    p.line = static_cast<std::uint32_t>(i + 1);
    points.push_back(p);
  }
  return points;
}

/// Whole paths under ±100 turns of the first rotary; the floor is the closed form's of one point.
void track_path(benchmark::State& state) {
  ScrewChain chain = test::table_table_ac();
  chain.joints[4].lower = -200.0 * M_PI;
  chain.joints[4].upper = 200.0 * M_PI;
  const auto pair = RotaryPair::from(chain);
  const auto points = rings(static_cast<std::size_t>(state.range(0)));
  BranchTrackingSettings settings;
  settings.held = JointVector::Zero(chain.size());
  const double floor = floor_ns({.sine_cosine = 2, .atan2 = 3, .sqrt = 6});
  const double start = processor_ns();
  for (auto _ : state) {
    const BranchTracking result = track_branches(*pair, points, settings);
    if (result.status != BranchTracking::Status::ok) state.SkipWithError(result.reason.c_str());
    benchmark::DoNotOptimize(result.q.data());
  }
  const double each = (processor_ns() - start) / static_cast<double>(state.iterations()) /
                      static_cast<double>(points.size());
  state.counters["ns_per_point"] = each;
  state.counters["floor_ns"] = floor;
  state.counters["ratio"] = each / floor;
}
BENCHMARK(track_path)->Arg(10000)->Arg(1000000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace smoothpost

BENCHMARK_MAIN();

#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace smoothpost {

/// A command that runs as a process of its own, with standard input closed and its output in a
/// file.
struct WorkerTask {
  std::vector<std::string> command;  ///< the program's path, then its arguments
  std::string log;                   ///< standard output and standard error, written anew
};

/// How a process has ended.
struct WorkerEnd {
  std::size_t task = 0;
  long process = 0;  ///< its id
  int status = -1;   ///< exit status; -1: it was ended by `signal`, or never started
  int signal = 0;
};

/// Runs every task, at most `at_once` at a time, in their order.
///
/// `ended` is called for each that has ended, `going` some ten times a second, both from the
/// caller's thread. Once `going` says false nothing new is started; what runs gets SIGINT, and
/// SIGKILL after ten seconds. Processes get SIGINT, too, when the caller dies. Other children of
/// the caller are left alone.
/// @return whether every task was run.   @pre at_once ≥ 1, no command is empty
bool run_workers(const std::vector<WorkerTask>& tasks, std::size_t at_once,
                 const std::function<void(const WorkerEnd&)>& ended,
                 const std::function<bool()>& going);

}  // namespace smoothpost

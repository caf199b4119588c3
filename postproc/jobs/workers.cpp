#include "postproc/jobs/workers.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kPoll = std::chrono::milliseconds(20);
constexpr int kPollsBetweenAsking = 4;
constexpr auto kGrace = std::chrono::seconds(10);

/// What a process of a task is given: files in place of the caller's, a process group of its own (a
/// terminal's Ctrl-C is the caller's to hand on), and signals as they are at first.
class SpawnRules {
 public:
  explicit SpawnRules(const std::string& log) {
    ::posix_spawn_file_actions_init(&files_);
    ::posix_spawn_file_actions_addopen(&files_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    ::posix_spawn_file_actions_addopen(&files_, STDOUT_FILENO, log.c_str(),
                                       O_WRONLY | O_CREAT | O_TRUNC, 0666);
    ::posix_spawn_file_actions_adddup2(&files_, STDOUT_FILENO, STDERR_FILENO);
    ::posix_spawnattr_init(&attributes_);
    sigset_t set;
    ::sigemptyset(&set);
    ::posix_spawnattr_setsigmask(&attributes_, &set);
    for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGCHLD}) ::sigaddset(&set, number);
    ::posix_spawnattr_setsigdefault(&attributes_, &set);
    ::posix_spawnattr_setpgroup(&attributes_, 0);
    ::posix_spawnattr_setflags(
        &attributes_, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  }
  SpawnRules(const SpawnRules&) = delete;
  SpawnRules& operator=(const SpawnRules&) = delete;
  ~SpawnRules() {
    ::posix_spawn_file_actions_destroy(&files_);
    ::posix_spawnattr_destroy(&attributes_);
  }

  /// The process id; 0 when there is no process to be had.
  pid_t start(const std::vector<std::string>& command) const {
    std::vector<char*> arguments;
    for (const auto& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    pid_t process = 0;
    const int error =
        ::posix_spawn(&process, arguments[0], &files_, &attributes_, arguments.data(), environ);
    return error == 0 ? process : 0;
  }

 private:
  posix_spawn_file_actions_t files_;
  posix_spawnattr_t attributes_;
};

struct Running {
  std::size_t task;
  pid_t process;
};

/// Whether it has ended, and how.
bool has_ended(const Running& worker, WorkerEnd& end) {
  int status = 0;
  const pid_t found = ::waitpid(worker.process, &status, WNOHANG);
  if (found == 0) return false;
  end = {worker.task, worker.process};
  // A caller that ignores SIGCHLD has its children reaped by the system: their status is lost.
  if (found == worker.process && WIFEXITED(status)) end.status = WEXITSTATUS(status);
  if (found == worker.process && WIFSIGNALED(status)) end.signal = WTERMSIG(status);
  return true;
}

}  // namespace

bool run_workers(const std::vector<WorkerTask>& tasks, std::size_t at_once,
                 const std::function<void(const WorkerEnd&)>& ended,
                 const std::function<bool()>& going) {
  require(at_once >= 1, "run_workers: at_once >= 1");
  std::vector<Running> running;
  std::size_t next = 0;
  bool stopping = false, killed = false;
  Clock::time_point stopped_at;
  const auto signal_all = [&running](int number) {
    for (const Running& worker : running) ::kill(worker.process, number);
  };
  for (int poll = 0; !running.empty() || (!stopping && next < tasks.size()); ++poll) {
    while (!stopping && next < tasks.size() && running.size() < at_once) {
      require(!tasks[next].command.empty(), "run_workers: a command");
      const pid_t process = SpawnRules(tasks[next].log).start(tasks[next].command);
      if (process > 0)
        running.push_back({next, process});
      else
        ended({next, 0});
      ++next;
    }
    for (std::size_t i = 0; i < running.size();) {
      WorkerEnd end;
      if (!has_ended(running[i], end)) {
        ++i;
        continue;
      }
      running.erase(running.begin() + static_cast<std::ptrdiff_t>(i));
      ended(end);
    }
    if (!stopping && poll % kPollsBetweenAsking == 0 && !going()) {
      stopping = true;
      stopped_at = Clock::now();
      signal_all(SIGINT);
    }
    if (stopping && !killed && Clock::now() - stopped_at > kGrace) {
      killed = true;
      signal_all(SIGKILL);
    }
    if (!running.empty()) std::this_thread::sleep_for(kPoll);
  }
  return !stopping;
}

}  // namespace smoothpost

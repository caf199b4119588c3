#include "postproc/jobs/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <vector>

namespace smoothpost {

namespace {

Diagnostic system_error(const char* code, const std::string& path, const std::string& what,
                        int error) {
  Diagnostic d;
  d.code = code;
  d.text = what + ": " + std::strerror(error);
  d.where.file = path;
  return d;
}

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  int get() const { return fd_; }

 private:
  int fd_;
};

constexpr int kMostLinks = 40;  // as the kernel follows

bool write_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

}  // namespace

Result<std::string> read_file(const std::string& path, std::size_t limit) {
  const Descriptor fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (fd.get() < 0)
    return Result<std::string>::failure(system_error("US130", path, "cannot be read", errno));
  struct stat info {};
  if (::fstat(fd.get(), &info) == 0 && S_ISDIR(info.st_mode))
    return Result<std::string>::failure(system_error("US130", path, "cannot be read", EISDIR));
  const auto too_large = [&] {
    return Result<std::string>::failure(
        system_error("US130", path, "is larger than " + std::to_string(limit) + " bytes", EFBIG));
  };
  std::string bytes;
  if (S_ISREG(info.st_mode) && info.st_size > 0) {
    if (static_cast<std::uintmax_t>(info.st_size) > limit) return too_large();
    bytes.reserve(static_cast<std::size_t>(info.st_size) + 1);
  }
  std::vector<char> buffer(1U << 20);
  while (true) {
    const ssize_t n = ::read(fd.get(), buffer.data(), buffer.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0)
      return Result<std::string>::failure(system_error("US130", path, "cannot be read", errno));
    if (n == 0) return bytes;
    bytes.append(buffer.data(), static_cast<std::size_t>(n));
    if (bytes.size() > limit) return too_large();
  }
}

Diagnostics check_target(const std::string& path) {
  namespace fs = std::filesystem;
  if (path.empty() || path == "-") return {};
  std::error_code ignored;
  if (fs::is_directory(path, ignored))
    return {system_error("US131", path, "is a folder: name a file in it", EISDIR)};
  const fs::path folder = fs::path(path).parent_path();
  if (!folder.empty() && !fs::is_directory(folder, ignored))
    return {system_error("US131", path, "cannot be written: no folder " + folder.string(),
                         fs::exists(folder, ignored) ? ENOTDIR : ENOENT)};
  return {};
}

namespace {

std::string temporary_name(const std::string& target, long process, int attempt) {
  return target + ".new" + std::to_string(process) + "-" + std::to_string(attempt);
}

}  // namespace

void remove_temporaries(const std::string& folder, long process) {
  namespace fs = std::filesystem;
  const std::string ending = temporary_name("", process, 0);
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder.empty() ? "." : folder, error))
    if (entry.path().filename().string().ends_with(ending)) fs::remove(entry.path(), error);
}

Diagnostics write_file(const std::string& path, std::string_view bytes) {
  namespace fs = std::filesystem;
  // Links are followed, also one whose file is not there yet.
  std::error_code ignored;
  fs::path target = path;
  for (int links = 0; fs::is_symlink(target, ignored); ++links) {
    if (links == kMostLinks) return {system_error("US131", path, "cannot be written", ELOOP)};
    const fs::path next = fs::read_symlink(target, ignored);
    target = next.is_absolute() ? next : target.parent_path() / next;
  }
  // Devices and pipes take the bytes as they are: there is nothing to rename over.
  struct stat info {};
  const bool exists = ::stat(target.c_str(), &info) == 0;
  if (exists && !S_ISREG(info.st_mode)) {
    const Descriptor fd(::open(target.c_str(), O_WRONLY | O_CLOEXEC));
    if (fd.get() < 0 || !write_all(fd.get(), bytes))
      return {system_error("US131", path, "cannot be written", errno)};
    return {};
  }
  std::string temporary;
  int raw = -1;
  for (int attempt = 0; attempt < 100 && raw < 0; ++attempt) {
    temporary = temporary_name(target.string(), ::getpid(), attempt);
    raw = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (raw < 0 && errno != EEXIST) break;
  }
  if (raw < 0) return {system_error("US131", path, "cannot be written", errno)};
  int error = 0;
  {
    const Descriptor fd(raw);
    if (exists) ::fchmod(fd.get(), info.st_mode & 07777);
    if (!write_all(fd.get(), bytes) || ::fsync(fd.get()) != 0) error = errno;
  }
  if (error == 0 && ::rename(temporary.c_str(), target.c_str()) != 0) error = errno;
  if (error != 0) {
    ::unlink(temporary.c_str());
    return {system_error("US131", path, "cannot be written", error)};
  }
  return {};
}

}  // namespace smoothpost

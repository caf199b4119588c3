#pragma once

#include <string>
#include <string_view>

#include "kernels/core/result.h"

namespace smoothpost {

/// The bytes of a file. Fails with US130 (reason of the system) for what cannot be read, and for
/// files of more than `limit` bytes.
Result<std::string> read_file(const std::string& path, std::size_t limit = std::size_t{2} << 30);

/// What forbids a file of that name before any work is done for it: it is a folder, or its own
/// folder is not there. "-" and nothing are fine. US131.
Diagnostics check_target(const std::string& path);

/// Writes a file so that at any moment `path` holds either its old content or all of the new: a
/// temporary beside it, flushed to the disk, renamed. A symbolic link is followed. Fails with
/// US131.
Diagnostics write_file(const std::string& path, std::string_view bytes);

/// Removes what a process that was killed inside write_file() has left in a folder.
void remove_temporaries(const std::string& folder, long process);

}  // namespace smoothpost

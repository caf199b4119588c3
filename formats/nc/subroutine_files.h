#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "formats/nc/program.h"
#include "kernels/core/diagnostic.h"

namespace smoothpost::nc {

/// A file that was found for a subroutine, or why none was read.
struct SubroutineFile {
  std::string name;  ///< without its folder; empty: none was found
  std::string path;  ///< with it
  std::string text;
  std::string problem;  ///< a file was found and may not be read
  bool found() const { return !name.empty(); }
};

/// Largest file of one subroutine.
inline constexpr std::size_t kLargestSubroutine = std::size_t{64} << 20;

/// Looks for the file of the subroutine `name` (lower case; siemens: upper case) in `folders`, in
/// their order, and reads it: NAME.ngc for LinuxCNC; O1234.nc, O1234.ngc, 1234.nc, 1234.ngc for the
/// number 1234 of the Fanuc family; NAME.SPF, name.spf, NAME.spf, name.SPF, then the same with MPF
/// for siemens, whose names have letters, digits and _ only.
///
/// Only files directly in one of the folders are opened: a name with a path, "..", a leading point
/// or other signs than letters, digits, _ - . is refused, and so is a file that is no regular file,
/// that a symbolic link leads out of its folder, or that is above kLargestSubroutine bytes.
SubroutineFile find_subroutine(const std::vector<std::string>& folders, std::string_view name,
                               InputDialect dialect);

}  // namespace smoothpost::nc

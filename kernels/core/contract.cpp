#include "kernels/core/contract.h"

#include <string_view>

namespace smoothpost {

void require(bool holds, const char* what, std::source_location where) {
  if (holds) return;
  std::string_view file = where.file_name();
  const auto slash = file.rfind('/');
  if (slash != std::string_view::npos) file.remove_prefix(slash + 1);
  throw ContractViolation(std::string(file) + ":" + std::to_string(where.line()) +
                          ": precondition broken: " + what);
}

}  // namespace smoothpost

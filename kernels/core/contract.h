#pragma once

#include <source_location>
#include <stdexcept>
#include <string>

namespace smoothpost {

/// A caller broke a documented precondition. Thrown in all build types; never the fault of a user's
/// file.
class ContractViolation : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

/// Throws ContractViolation with file, line and `what` unless `holds`. Cost: one branch.
void require(bool holds, const char* what,
             std::source_location where = std::source_location::current());

}  // namespace smoothpost

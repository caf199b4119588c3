#pragma once

#include <optional>
#include <utility>

#include "kernels/core/contract.h"
#include "kernels/core/diagnostic.h"

namespace smoothpost {

/// A value, or the reasons why there is none. A result with a value may carry warnings and notes;
/// one without a value carries at least one error.
template <class T>
class Result {
 public:
  Result(T value, Diagnostics diagnostics = {})  // NOLINT(google-explicit-constructor)
      : value_(std::move(value)), diagnostics_(std::move(diagnostics)) {}

  /// @pre `diagnostics` holds at least one error.
  static Result failure(Diagnostics diagnostics) {
    require(has_error(diagnostics), "a failed Result needs an error");
    Result result;
    result.diagnostics_ = std::move(diagnostics);
    return result;
  }
  static Result failure(Diagnostic diagnostic) {
    return failure(Diagnostics{std::move(diagnostic)});
  }

  bool ok() const { return value_.has_value(); }
  /// @pre ok()
  T& value() {
    require(ok(), "value() of a failed Result");
    return *value_;
  }
  const T& value() const {
    require(ok(), "value() of a failed Result");
    return *value_;
  }
  const Diagnostics& diagnostics() const { return diagnostics_; }

 private:
  Result() = default;
  std::optional<T> value_;
  Diagnostics diagnostics_;
};

}  // namespace smoothpost

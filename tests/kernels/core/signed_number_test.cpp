#include "kernels/core/signed_number.h"

#include <catch2/catch.hpp>

using namespace smoothpost;

TEST_CASE("signed_number: one sign, of either kind", "[kernels][core]") {
  double value = 0.0;
  const auto whole = [&](std::string_view text) {
    const auto end = from_signed(text, value);
    return end.ec == std::errc() && end.ptr == text.data() + text.size();
  };
  CHECK((whole("1.5") && value == 1.5));
  CHECK((whole("+1.5") && value == 1.5));
  CHECK((whole("-1.5") && value == -1.5));
  CHECK((whole("+.5e1") && value == 5.0));
  for (const char* bad : {"+-1", "-+1", "++1", "--1", "+", "-", "", " 1", "1 ", "+ 1"}) {
    INFO(bad);
    CHECK_FALSE(whole(bad));
  }
  CHECK(from_signed("+1e999", value).ec == std::errc::result_out_of_range);
}

#include "postproc/report/html_text.h"

#include <catch2/catch.hpp>
#include <limits>

using namespace smoothpost;

TEST_CASE("escape_html: markup becomes entities and only UTF-8 passes", "[postproc][report]") {
  CHECK(escape_html("<b a=\"1\" c='2'>&") == "&lt;b a=&quot;1&quot; c=&#39;2&#39;&gt;&amp;");
  CHECK(escape_html("a\nb\tc") == "a b c");
  const std::string bad = "\xEF\xBF\xBD";
  CHECK(escape_html(std::string("a\0b\x1b", 4)) == "a" + bad + "b" + bad);
  CHECK(escape_html("\xC3\xA4\xE2\x89\xA4\xF0\x9F\x98\x80") ==
        "\xC3\xA4\xE2\x89\xA4\xF0\x9F\x98\x80");
  // a lone lead byte, an overlong '<', a surrogate, a sequence that the end cuts off
  CHECK(escape_html("\xFFx") == bad + "x");
  CHECK(escape_html("\xC0\xBC") == bad + bad);
  CHECK(escape_html("\xED\xA0\x80") == bad + bad + bad);
  CHECK(escape_html("\xE2\x89") == bad + bad);
  CHECK(escape_html("\xE2<") == bad + "&lt;");
}

TEST_CASE("short_number: significant digits without zeros and without a locale",
          "[postproc][report]") {
  CHECK(short_number(0.0) == "0");
  CHECK(short_number(-0.0) == "0");
  CHECK(short_number(1234.5678) == "1235");
  CHECK(short_number(12.345678) == "12.35");
  CHECK(short_number(0.0012345678) == "0.001235");
  CHECK(short_number(-2.5) == "-2.5");
  CHECK(short_number(1.5e-9) == "1.5e-9");
  CHECK(short_number(2.5e12) == "2.5e12");
  CHECK(short_number(std::numeric_limits<double>::infinity()) == "no bound");
  CHECK(short_number(std::numeric_limits<double>::quiet_NaN()) == "unknown");
}

TEST_CASE("base64: the vectors of RFC 4648", "[postproc][report]") {
  CHECK(base64("").empty());
  CHECK(base64("f") == "Zg==");
  CHECK(base64("fo") == "Zm8=");
  CHECK(base64("foo") == "Zm9v");
  CHECK(base64("foob") == "Zm9vYg==");
  CHECK(base64("fooba") == "Zm9vYmE=");
  CHECK(base64("foobar") == "Zm9vYmFy");
  CHECK(base64("\xff\xfe\xfd") == "//79");
}

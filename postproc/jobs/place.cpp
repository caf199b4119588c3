#include "postproc/jobs/place.h"

#include <algorithm>
#include <array>

#include "kernels/core/units.h"
#include "machines/dialects/decimal.h"

namespace smoothpost {

namespace {

std::string fixed(double value, int digits) {
  std::string text;
  append_decimal(text, value, digits);
  return text;
}

std::string shortest(double value) {
  std::string text = fixed(value, 4);
  if (text.find('.') == std::string::npos) return text;
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

OffsetOption offset_of(const FoundPlace& place, int system) {
  return {system, place.position, place.turn};
}

std::string told(const PlaceMargin& margin) {
  return margin.name + " " + fixed(margin.value, 3) + ", input line " + std::to_string(margin.line);
}

Diagnostic found(const char* code, std::string text) { return usage_error(code, std::move(text)); }

/// Why a program was not certified: its first error.
std::string reason_of(const Conversion& conversion) {
  for (const auto& d : conversion.diagnostics)
    if (d.severity == Severity::error)
      return (d.where.line > 0 ? "input line " + std::to_string(d.where.line) + ", " : "") +
             d.text + " [" + d.code + "]";
  return to_string(conversion.verdict);
}

/// The errors of a conversion when one of them would be the same at every place: all but those of
/// motion (KN) and checks (CK).
Diagnostics of_no_place(const Conversion& conversion) {
  Diagnostics errors;
  bool everywhere = false;
  for (const auto& d : conversion.diagnostics) {
    if (d.severity != Severity::error) continue;
    errors.push_back(d);
    everywhere = everywhere || (d.code.rfind("KN", 0) != 0 && d.code.rfind("CK", 0) != 0);
  }
  return everywhere ? errors : Diagnostics{};
}

/// With `digits` places always, for a column.
std::string column(double value, int digits) {
  std::string text = fixed(value, digits);
  if (text.find('.') == std::string::npos) text += '.';
  while (text.size() - text.find('.') <= static_cast<std::size_t>(digits)) text += '0';
  return text;
}

}  // namespace

Result<PlaceOptions> read_place_options(const Options& options) {
  PlaceOptions out;
  Diagnostics errors;
  if (!options.box.empty()) {
    std::array<double, 6> numbers{};
    std::size_t count = 0;
    bool good = true;
    for (std::size_t begin = 0; good && begin <= options.box.size(); ++count) {
      const std::size_t end = std::min(options.box.find(',', begin), options.box.size());
      const auto value = read_number(std::string_view(options.box).substr(begin, end - begin));
      good = value.has_value() && count < 6;
      if (good) numbers[count] = *value;
      begin = end + 1;
    }
    out.box.emplace();
    out.box->lower = Vec3(numbers[0], numbers[1], numbers[2]);
    out.box->upper = Vec3(numbers[3], numbers[4], numbers[5]);
    if (!good || count != 6 || (out.box->lower.array() > out.box->upper.array()).any())
      errors.push_back(
          usage_error("US160", "--box " + options.box +
                                   ": expected is x0,y0,z0,x1,y1,z1, the least and the largest "
                                   "values of the program's zero in mm"));
  }
  if (!options.turn.empty()) {
    const auto turn = read_number(options.turn);
    if (turn && *turn >= 0.0 && *turn <= 180.0)
      out.turn = radians_from_degrees(*turn);
    else
      errors.push_back(usage_error("US161", "--turn " + options.turn +
                                                ": expected is the largest turn about the vertical "
                                                "in degrees, 0 to 180"));
  }
  if (!errors.empty()) return Result<PlaceOptions>::failure(std::move(errors));
  return out;
}

std::string system_name(int system) {
  return system <= 6 ? "G" + std::to_string(53 + system) : "G59." + std::to_string(system - 6);
}

std::string work_offset_text(int system, const OffsetOption& offset) {
  std::string text = system_name(system) + "=";
  for (int i = 0; i < 3; ++i) text += (i ? "," : "") + shortest(offset.position[i]);
  for (int i = 0; i < 3; ++i) text += "," + shortest(degrees_from_radians(offset.turn[i]));
  return text;
}

std::string placement_sentence(const OffsetOption& o) {
  std::string text = "the program's zero lies at " + fixed(o.position.x(), 4) + ", " +
                     fixed(o.position.y(), 4) + ", " + fixed(o.position.z(), 4) +
                     " mm in the machine's workpiece frame";
  if (o.turn.norm() > 0.0)
    text += ", turned by " + fixed(degrees_from_radians(o.turn.x()), 4) + ", " +
            fixed(degrees_from_radians(o.turn.y()), 4) + ", " +
            fixed(degrees_from_radians(o.turn.z()), 4) + " deg about X, Y, Z";
  return text;
}

Result<PlacedConversion> first_certified(
    const Places& places, int system,
    const std::function<Conversion(const FoundPlace&)>& convert_at) {
  const PlaceMargin& most = places.best.front().margins.tightest();
  if (most.value < 0.0)
    return Result<PlacedConversion>::failure(found(
        "KN141", "no place was found where the machine reaches the whole path: at the best, " +
                     work_offset_text(system, offset_of(places.best.front(), system)) +
                     ", the least margin is " + told(most) +
                     ". Widen --box or --turn, or choose a machine with more range"));
  std::string refused;
  for (std::size_t i = 0; i < places.best.size(); ++i) {
    if (places.best[i].margins.tightest().value < 0.0) break;
    PlacedConversion out{i, convert_at(places.best[i])};
    if (out.conversion.verdict == Verdict::certified) {
      Diagnostics notes;
      if (!refused.empty()) {
        notes.push_back(found("KN143",
                              "places with more margin were passed over, because no "
                              "program could be certified there: " +
                                  refused));
        notes.back().severity = Severity::note;
      }
      return Result<PlacedConversion>(std::move(out), std::move(notes));
    }
    const Diagnostics errors = of_no_place(out.conversion);
    if (!errors.empty()) return Result<PlacedConversion>::failure(errors);
    refused += (refused.empty() ? "" : "; ") +
               work_offset_text(system, offset_of(places.best[i], system)) + ": " +
               reason_of(out.conversion);
  }
  return Result<PlacedConversion>::failure(
      found("KN142",
            "places within reach and limits were found, but no program could be certified "
            "at any: " +
                refused));
}

std::string place_text(const Places& places, std::size_t place, int system) {
  const FoundPlace& best = places.best[place];
  std::string text = "--work-offset " + work_offset_text(system, offset_of(best, system)) + "\n";
  text += "least margin " + told(best.margins.tightest()) +
          "; before: " + told(places.before.tightest()) + "\n\n";
  text += "margin            before   input line      there   input line\n";
  const auto cell = [](const std::string& words, std::size_t width) {
    return words.size() < width ? std::string(width - words.size(), ' ') + words : words;
  };
  const auto row = [&](const std::string& name, const PlaceMargin* a, const PlaceMargin* b) {
    text += name + std::string(name.size() < 14 ? 14 - name.size() : 1, ' ');
    text += cell(a ? column(a->value, 3) : "-", 10) + cell(a ? std::to_string(a->line) : "-", 13);
    text += cell(b ? column(b->value, 3) : "-", 11) + cell(b ? std::to_string(b->line) : "-", 13);
    text += "\n";
  };
  const auto& before = places.before.all;
  for (const auto& margin : best.margins.all) {
    const auto old = std::find_if(before.begin(), before.end(), [&margin](const PlaceMargin& m) {
      return m.name == margin.name;
    });
    row(margin.name, old == before.end() ? nullptr : &*old, &margin);
  }
  if (before.back().name == "reach") row("reach", &before.back(), nullptr);
  return text +
         "1 is the middle of a range, 0 its end, less is beyond. Clearance was not looked at.\n";
}

PlacementReport placement_report(const Places& places, std::optional<std::size_t> place,
                                 int system) {
  const auto rows = [](const PlaceMargins& margins) {
    std::vector<PlacementReport::Margin> out;
    for (const auto& m : margins.all) out.push_back({m.name, m.value, m.line});
    return out;
  };
  PlacementReport out;
  out.found = place.has_value();
  const FoundPlace& best = places.best[place.value_or(0)];
  out.work_offset = work_offset_text(system, offset_of(best, system));
  out.before = rows(places.before);
  out.after = rows(best.margins);
  out.evaluations = places.evaluations;
  return out;
}

}  // namespace smoothpost

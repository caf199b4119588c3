#include "machines/definition/table_reader.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <tuple>
#include <utility>

#include "kernels/core/nearest_name.h"

namespace smoothpost::machine_file {

namespace {

constexpr double kLargestNumber = 1e9;  // of any unit

/// Longest first, so that "_mm_per_s" is not taken for "_s".
constexpr std::array<std::string_view, 16> kUnits = {
    "_inch_per_s3", "_inch_per_s2", "_mm_per_min", "_inch_per_s", "_deg_per_s3", "_deg_per_s2",
    "_mm_per_s3",   "_mm_per_s2",   "_deg_per_s",  "_mm_per_s",   "_inch",       "_deg",
    "_rad",         "_mm",          "_ms",         "_s"};

bool before(const Diagnostic& a, const Diagnostic& b) {
  const auto place = [](const Diagnostic& d) {
    return std::make_tuple(d.where.line == 0, d.where.line, d.where.column);
  };
  return place(a) < place(b);
}

}  // namespace

std::string to_text(double value) {
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  return std::string(buffer.data(), end);
}

std::string one_of(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) text += i + 1 == names.size() ? " or " : ", ";
    text += names[i];
  }
  return text;
}

std::string_view without_unit(std::string_view key) {
  for (const std::string_view unit : kUnits)
    if (key.size() > unit.size() && key.ends_with(unit))
      return key.substr(0, key.size() - unit.size());
  return key;
}

void Problems::error(const char* code, std::string text, const SourceLocation& where) {
  if (list_.size() >= kMaxErrors) {
    ++left_out_;
    return;
  }
  list_.push_back({Severity::error, code, std::move(text), where});
}

void Problems::warning(const char* code, std::string text, const SourceLocation& where) {
  if (list_.size() < kMaxErrors) list_.push_back({Severity::warning, code, std::move(text), where});
}

void Problems::add(const Diagnostics& more) { list_.insert(list_.end(), more.begin(), more.end()); }

Diagnostics Problems::take() {
  std::stable_sort(list_.begin(), list_.end(), before);
  if (left_out_ > 0)
    list_.push_back({Severity::error,
                     "MF125",
                     std::to_string(left_out_) + " further errors are not shown: mend these first",
                     {}});
  left_out_ = 0;
  return std::exchange(list_, {});
}

TableReader::TableReader(const TomlTable* table, std::string title, SourceLocation where,
                         Problems& problems)
    : table_(table), title_(std::move(title)), where_(std::move(where)), problems_(&problems) {}

bool TableReader::has(std::string_view key) const {
  return table_ != nullptr && table_->find(key) != nullptr;
}

const TomlEntry* TableReader::entry(std::string_view key) {
  known_.emplace_back(key);
  return table_ != nullptr ? table_->find(key) : nullptr;
}

SourceLocation TableReader::where(std::string_view key) const {
  const TomlEntry* found = table_ != nullptr ? table_->find(key) : nullptr;
  return found != nullptr ? found->value.where : where_;
}

void TableReader::error(const char* code, const std::string& text, std::string_view key) {
  problems_->error(code, text, where(key));
}

void TableReader::error(const char* code, const std::string& text, const SourceLocation& place) {
  problems_->error(code, text, place);
}

/// Whether the table has the key with another unit, or none: that is reported by finish().
bool TableReader::has_other_unit(std::string_view key) const {
  if (table_ == nullptr || without_unit(key) == key) return false;
  const auto& entries = table_->entries();
  return std::any_of(entries.begin(), entries.end(), [&](const TomlEntry& entry) {
    return without_unit(entry.key) == without_unit(key);
  });
}

const TomlEntry* TableReader::take(std::string_view key, TomlKind kind) {
  const bool needed = std::exchange(required_, false);
  const TomlEntry* found = entry(key);
  if (found == nullptr) {
    if (needed && !has_other_unit(key))
      problems_->error("MF105", title_ + " has no key " + std::string(key) + ": add it", where_);
    return nullptr;
  }
  const TomlKind is = found->value.kind;
  if (is == kind || (kind == TomlKind::real && is == TomlKind::integer)) return found;
  const std::string wanted = kind == TomlKind::real ? "a number" : to_string(kind);
  problems_->error("MF106", std::string(key) + " is " + to_string(is) + " and has to be " + wanted,
                   found->value.where);
  return nullptr;
}

std::optional<double> TableReader::finite(const TomlValue& value, const std::string& what) {
  if (!value.is_number()) {
    problems_->error("MF106", what + " is " + to_string(value.kind) + " and has to be a number",
                     value.where);
    return std::nullopt;
  }
  if (!std::isfinite(value.real)) {
    problems_->error("MF109", what + " is not a finite number", value.where);
    return std::nullopt;
  }
  return value.real;
}

std::optional<double> TableReader::number(std::string_view key, Bound bound) {
  const TomlEntry* found = take(key, TomlKind::real);
  if (found == nullptr) return std::nullopt;
  const auto value = finite(found->value, std::string(key));
  if (!value) return std::nullopt;
  if (std::abs(*value) > kLargestNumber) {
    error("MF108",
          std::string(key) + " is " + to_text(*value) + " and has to be 1000000000 at most", key);
    return std::nullopt;
  }
  const bool too_small =
      (bound == Bound::positive && *value <= 0.0) || (bound == Bound::not_negative && *value < 0.0);
  if (!too_small) return value;
  error("MF108",
        std::string(key) + " is " + to_text(*value) + " and has to be " +
            (bound == Bound::positive ? "more than 0" : "at least 0"),
        key);
  return std::nullopt;
}

double TableReader::number_or(std::string_view key, double fallback, Bound bound) {
  return number(key, bound).value_or(fallback);
}

std::optional<int> TableReader::integer(std::string_view key, int lowest, int highest) {
  const TomlEntry* found = take(key, TomlKind::integer);
  if (found == nullptr) return std::nullopt;
  const std::int64_t value = found->value.integer;
  if (value >= lowest && value <= highest) return static_cast<int>(value);
  error("MF108",
        std::string(key) + " is " + std::to_string(value) + " and has to be from " +
            std::to_string(lowest) + " to " + std::to_string(highest),
        key);
  return std::nullopt;
}

std::optional<bool> TableReader::boolean(std::string_view key) {
  const TomlEntry* found = take(key, TomlKind::boolean);
  return found != nullptr ? std::optional<bool>(found->value.boolean) : std::nullopt;
}

std::optional<std::string> TableReader::text(std::string_view key) {
  const TomlEntry* found = take(key, TomlKind::string);
  return found != nullptr ? std::optional<std::string>(found->value.string) : std::nullopt;
}

std::optional<std::string> TableReader::choice(std::string_view key,
                                               std::vector<std::string> allowed) {
  auto value = text(key);
  if (!value || std::find(allowed.begin(), allowed.end(), *value) != allowed.end()) return value;
  error("MF113",
        std::string(key) + " is \"" + value->substr(0, 64) + "\" and has to be " + one_of(allowed),
        key);
  return std::nullopt;
}

std::optional<std::vector<double>> TableReader::numbers(std::string_view key) {
  const TomlEntry* found = take(key, TomlKind::array);
  if (found == nullptr) return std::nullopt;
  std::vector<double> values;
  for (std::size_t i = 0; i < found->value.items.size(); ++i) {
    const auto value =
        finite(found->value.items[i], "item " + std::to_string(i + 1) + " of " + std::string(key));
    if (!value) return std::nullopt;
    values.push_back(*value);
  }
  return values;
}

std::optional<std::vector<double>> TableReader::numbers(std::string_view key, std::size_t count) {
  auto values = numbers(key);
  if (!values || values->size() == count) return values;
  error("MF106",
        std::string(key) + " has " + std::to_string(values->size()) + " numbers and has to have " +
            std::to_string(count),
        key);
  return std::nullopt;
}

std::optional<Vec3> TableReader::vector(std::string_view key) {
  const auto values = numbers(key, 3);
  if (!values) return std::nullopt;
  return Vec3((*values)[0], (*values)[1], (*values)[2]);
}

std::optional<std::vector<Vec3>> TableReader::vectors(std::string_view key, std::size_t most) {
  const TomlEntry* found = take(key, TomlKind::array);
  if (found == nullptr) return std::nullopt;
  const auto& items = found->value.items;
  if (items.size() > most) {
    problems_->error("MF119",
                     std::string(key) + " has " + std::to_string(items.size()) +
                         " points; at most " + std::to_string(most) + " can be used",
                     items[most].where);
    return std::nullopt;
  }
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < items.size(); ++i) {
    const std::string what = "item " + std::to_string(i + 1) + " of " + std::string(key);
    if (items[i].kind != TomlKind::array || items[i].items.size() != 3) {
      problems_->error("MF106", what + " has to be a list of 3 numbers", items[i].where);
      return std::nullopt;
    }
    Vec3 point;
    for (int k = 0; k < 3; ++k) {
      const auto value = finite(items[i].items[static_cast<std::size_t>(k)], "a number of " + what);
      if (!value) return std::nullopt;
      point[k] = *value;
    }
    points.push_back(point);
  }
  return points;
}

bool TableReader::is_pair(const TomlValue& value, const std::string& what) {
  const auto is_text = [](const TomlValue& item) { return item.kind == TomlKind::string; };
  const bool good = value.kind == TomlKind::array && value.items.size() == 2 &&
                    is_text(value.items[0]) && is_text(value.items[1]);
  if (!good)
    problems_->error("MF106", what + " has to be a list of 2 strings: [\"a\", \"b\"]", value.where);
  return good;
}

std::vector<const TomlValue*> TableReader::pairs(std::string_view key) {
  std::vector<const TomlValue*> out;
  const TomlEntry* found = take(key, TomlKind::array);
  if (found == nullptr) return out;
  for (const auto& item : found->value.items)
    if (is_pair(item, "every item of " + std::string(key))) out.push_back(&item);
  return out;
}

const TomlValue* TableReader::pair(std::string_view key) {
  const TomlEntry* found = take(key, TomlKind::array);
  return found != nullptr && is_pair(found->value, std::string(key)) ? &found->value : nullptr;
}

std::optional<Vec3> TableReader::direction(std::string_view key) {
  const auto value = vector(key);
  if (!value) return std::nullopt;
  const double length = value->stableNorm();
  if (std::isfinite(length) && length > 1e-12) return Vec3(*value / length);
  error("MF111", std::string(key) + " has no direction: its length is " + to_text(length), key);
  return std::nullopt;
}

std::optional<std::vector<std::string>> TableReader::lines(std::string_view key) {
  const TomlEntry* found = take(key, TomlKind::array);
  if (found == nullptr) return std::nullopt;
  std::vector<std::string> out;
  for (const auto& item : found->value.items) {
    const bool one_line = item.kind == TomlKind::string &&
                          std::none_of(item.string.begin(), item.string.end(), [](char c) {
                            return static_cast<unsigned char>(c) < 0x20U && c != '\t';
                          });
    if (one_line) {
      out.push_back(item.string);
      continue;
    }
    problems_->error("MF106",
                     "every item of " + std::string(key) + " has to be a string of one line",
                     item.where);
  }
  return out;
}

TableReader TableReader::table(std::string_view key, std::string title) {
  const TomlEntry* found = take(key, TomlKind::table);
  if (found == nullptr) return {nullptr, std::move(title), where_, *problems_};
  return {&found->value.table, std::move(title), found->value.where, *problems_};
}

std::vector<const TomlValue*> TableReader::tables(std::string_view key) {
  std::vector<const TomlValue*> out;
  const TomlEntry* found = take(key, TomlKind::array);
  if (found == nullptr) return out;
  for (const auto& item : found->value.items) {
    if (item.kind == TomlKind::table)
      out.push_back(&item);
    else
      problems_->error("MF106", "every item of " + std::string(key) + " has to be a table",
                       item.where);
  }
  return out;
}

std::vector<const TomlEntry*> TableReader::entries() {
  std::vector<const TomlEntry*> out;
  if (table_ == nullptr) return out;
  for (const auto& entry : table_->entries()) {
    out.push_back(&entry);
    known_.emplace_back(entry.key);
  }
  return out;
}

void TableReader::report_unknown(const TomlEntry& entry) {
  const std::string shown = entry.key.substr(0, 64);
  const bool same_stem = without_unit(entry.key) != entry.key || entry.key.size() < 64;
  for (const auto& known : known_) {
    if (!same_stem || without_unit(known) == known) continue;
    if (without_unit(known) != without_unit(entry.key)) continue;
    const bool has_unit = without_unit(entry.key) != entry.key;
    problems_->error("MF107",
                     shown + (has_unit ? " has the wrong unit here" : " has no unit") + ": write " +
                         known + " and give the value in that unit",
                     entry.where);
    return;
  }
  const std::string guess = problems_->full() ? std::string() : nearest_name(entry.key, known_);
  problems_->error(
      "MF104",
      title_ + " knows no key " + shown +
          (guess.empty() ? std::string(": remove it") : ": did you mean " + guess + "?"),
      entry.where);
}

void TableReader::finish() {
  if (table_ == nullptr) return;
  for (const auto& entry : table_->entries())
    if (std::find(known_.begin(), known_.end(), entry.key) == known_.end()) report_unknown(entry);
}

}  // namespace smoothpost::machine_file

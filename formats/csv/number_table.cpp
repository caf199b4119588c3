#include "formats/csv/number_table.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/signed_number.h"

namespace smoothpost {

namespace {

constexpr double kLargest = 1e6;
constexpr std::size_t kMostErrors = 100;
constexpr std::size_t kMostColumns = 100;

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

class Reader {
 public:
  Reader(const std::string& file, std::size_t largest_rows) : file_(file), most_(largest_rows) {}

  Result<NumberTable> read(std::string_view text) {
    while (!text.empty() && !stopped_) {
      const auto end = text.find('\n');
      std::string_view line = text.substr(0, end);
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
      ++line_;
      line = trimmed(line.substr(0, line.find('#')));
      if (line.empty()) continue;
      split(line);
      table_.columns.empty() ? header() : row();
    }
    if (table_.columns.empty())
      error("CSV101", "no header line with the names of the columns", 0);
    else if (table_.rows.empty() && !has_error(errors_))
      error("CSV114", "no row below the header", 0);
    if (has_error(errors_)) return Result<NumberTable>::failure(std::move(errors_));
    return std::move(table_);
  }

 private:
  void error(const char* code, std::string text, int line) {
    errors_.push_back({Severity::error, code, std::move(text), {file_, line, 0}});
    if (errors_.size() < kMostErrors) return;
    stopped_ = true;
    errors_.push_back(
        {Severity::note, "CSV116", "reading stops after 100 errors", {file_, line, 0}});
  }

  void split(std::string_view line) {
    fields_.clear();
    while (fields_.size() <= kMostColumns) {
      const auto comma = line.find(',');
      fields_.push_back(trimmed(line.substr(0, comma)));
      if (comma == std::string_view::npos) return;
      line.remove_prefix(comma + 1);
    }
  }

  void header() {
    for (const auto field : fields_) {
      if (table_.column(field) >= 0)
        error("CSV103", "column `" + std::string(field.substr(0, 64)) + "` stands twice", line_);
      table_.columns.emplace_back(field.substr(0, 64));
    }
  }

  void row() {
    if (fields_.size() != table_.columns.size())
      return error("CSV105",
                   std::to_string(fields_.size()) + " fields, and the header has " +
                       std::to_string(table_.columns.size()),
                   line_);
    if (table_.rows.size() >= most_) {
      error("CSV105", "more than " + std::to_string(most_) + " rows", line_);
      stopped_ = true;
      return;
    }
    std::vector<double> values;
    for (std::size_t i = 0; i < fields_.size(); ++i) {
      const std::string_view field = fields_[i];
      double value = 0.0;
      const char* end = field.data() + field.size();
      const auto [next, fault] = from_signed(field, value);
      if (fault != std::errc() || next != end)
        error("CSV106",
              table_.columns[i] + ": `" + std::string(field.substr(0, 64)) + "` is no number",
              line_);
      else if (!(std::abs(value) <= kLargest))
        error("CSV107",
              table_.columns[i] + ": " + std::string(field.substr(0, 64)) + " is beyond 1000000",
              line_);
      values.push_back(value);
    }
    table_.rows.push_back(std::move(values));
    table_.lines.push_back(line_);
  }

  std::string file_;
  std::size_t most_;
  int line_ = 0;
  bool stopped_ = false;
  std::vector<std::string_view> fields_;
  NumberTable table_;
  Diagnostics errors_;
};

}  // namespace

int NumberTable::column(std::string_view name) const {
  const auto found = std::find(columns.begin(), columns.end(), name);
  return found == columns.end() ? -1 : static_cast<int>(found - columns.begin());
}

Result<NumberTable> read_number_table(std::string_view text, const std::string& file_name,
                                      std::size_t largest_rows) {
  return Reader(file_name, largest_rows).read(text);
}

}  // namespace smoothpost

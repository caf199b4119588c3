#include "postproc/report/html_table.h"

#include <algorithm>

#include "postproc/report/html_text.h"

namespace smoothpost {

namespace {
constexpr std::size_t kLongTable = 15;
}

std::string number_cell(const std::string& text) {
  return "<td class=\"number\">" + escape_html(text) + "</td>";
}

std::string line_cell(const std::string& text, const char* side) {
  const std::size_t digits = std::min(text.find_first_not_of("0123456789"), text.size());
  if (digits == 0) return number_cell(text);
  return std::string("<td class=\"number\"><a href=\"#view\" data-") + side + "-line=\"" +
         text.substr(0, digits) + "\">" + escape_html(text) + "</a></td>";
}

SortTable::SortTable(std::vector<Column> columns, bool scrolls)
    : columns_(std::move(columns)), scrolls_(scrolls) {}

void SortTable::row(const std::vector<std::string>& cells) {
  rows_ += "<tr>";
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Column column = i < columns_.size() ? columns_[i] : Column{};
    rows_ += column.input_line ? line_cell(cells[i], "input")
             : column.number   ? number_cell(cells[i])
                               : "<td>" + escape_html(cells[i]) + "</td>";
  }
  rows_ += "</tr>\n";
  ++count_;
}

std::string SortTable::html() const {
  const bool tall = scrolls_ && count_ > kLongTable;
  std::string out = std::string("<div class=\"") + (tall ? "scroll tall" : "scroll") +
                    "\"><table class=\"sortable\"><thead><tr>";
  for (const Column& c : columns_)
    out += std::string(c.number ? "<th class=\"number\">" : "<th>") + escape_html(c.name) + "</th>";
  return out + "</tr></thead><tbody>\n" + rows_ + "</tbody></table></div>\n";
}

void PairTable::row(const std::string& name, const std::string& value) {
  if (value.empty()) return;
  rows_ += "<tr><th>" + escape_html(name) + "</th><td>" + escape_html(value) + "</td></tr>\n";
}

std::string PairTable::html() const {
  return "<table class=\"pairs\"><tbody>\n" + rows_ + "</tbody></table>\n";
}

}  // namespace smoothpost

#pragma once

#include <string>
#include <vector>

namespace smoothpost {

/// A cell of a number, escaped.
std::string number_cell(const std::string& text);

/// A cell of a line number, or of words that begin with one, as a link to its place in the 3D view:
/// `side` is input or output. Empty text: an empty cell.
std::string line_cell(const std::string& text, const char* side);

/// A table whose columns a script can sort by (page/tables.js); without one it stands as it is.
class SortTable {
 public:
  struct Column {
    std::string name;
    bool number = false;
    bool input_line = false;  ///< cells are line_cell()
  };
  /// `scrolls`: long ones get a box of their own on the screen.
  explicit SortTable(std::vector<Column> columns, bool scrolls = true);
  /// One text a column; escaped.
  void row(const std::vector<std::string>& cells);
  std::string html() const;

 private:
  std::vector<Column> columns_;
  bool scrolls_;
  std::size_t count_ = 0;
  std::string rows_;
};

/// Names and values, one a row; rows without a value are left out.
class PairTable {
 public:
  void row(const std::string& name, const std::string& value);
  std::string html() const;

 private:
  std::string rows_;
};

}  // namespace smoothpost

#include "formats/nc/siemens_assignment.h"

#include <algorithm>
#include <cmath>

#include "formats/nc/number.h"
#include "formats/nc/number_text.h"
#include "formats/nc/siemens_words.h"

namespace smoothpost::nc {
namespace {

constexpr double kMostCells = 10'000.0;

bool begins_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == '$';
}
bool in_name(char c) { return begins_name(c) || detail::is_digit(c); }

std::optional<SiemensType> type_of(std::string_view name) {
  if (name == "REAL") return SiemensType::real;
  if (name == "INT") return SiemensType::integer;
  if (name == "BOOL") return SiemensType::boolean;
  if (name == "STRING") return SiemensType::text;
  return std::nullopt;
}

class Reader {
 public:
  Reader(std::string_view text, SiemensVariables* variables) : text_(text), variables_(variables) {}

  Evaluated assignment() {
    const std::string variable = name();
    std::vector<double> indices = read_indices();
    if (out_.ok() && !take('=')) fail("= is missing");
    if (out_.ok()) read_value(variable, indices);
    return done();
  }

  Evaluated declaration(std::vector<std::string>* names) {
    name();  // DEF
    const std::optional<SiemensType> type = type_of(name());
    if (!type) fail("DEF is read for REAL, INT, BOOL and STRING[n]");
    if (type == SiemensType::text) read_indices();
    while (out_.ok()) {
      declare(*type, names);
      if (!out_.ok() || !take(',')) break;
    }
    return done();
  }

  SiemensProcedure procedure() {
    SiemensProcedure out;
    name();  // PROC
    out.name = name();
    if (out.name.empty()) fail("the name of the subprogram is missing");
    if (out_.ok() && take('(') && !take(')')) {
      while (out_.ok()) {
        parameter(out);
        if (!out_.ok() || take(')')) break;
        if (!take(',')) fail("a comma or ) is missing between the parameters");
      }
    }
    while (out_.ok() && !at_end()) {
      const std::string attribute = name();
      const bool known = attribute == "DISPLOF" || attribute == "DISPLON" || attribute == "SBLOF" ||
                         attribute == "SBLON" || attribute == "ACTBLOCNO";
      if (!known)
        fail(attribute.empty() ? "text behind the parameters" : attribute + " is not read");
    }
    out.problem = std::move(out_.problem);
    return out;
  }

 private:
  bool at_end() {
    while (at_ < text_.size() && detail::is_blank(text_[at_])) ++at_;
    return at_ == text_.size();
  }
  bool take(char c) {
    if (at_end() || text_[at_] != c) return false;
    ++at_;
    return true;
  }
  char peek() { return at_end() ? '\0' : text_[at_]; }

  std::string name() {
    at_end();
    const std::size_t begin = at_;
    if (at_ < text_.size() && begins_name(text_[at_])) {
      while (at_ < text_.size() && in_name(text_[at_])) ++at_;
    }
    return upper_text(text_.substr(begin, at_ - begin));
  }

  void fail(std::string problem) {
    if (!out_.ok()) return;
    out_.problem = std::move(problem);
    out_.at = at_;
  }

  Evaluated done() {
    out_.length = at_;
    return std::move(out_);
  }

  double value() {
    at_end();
    Evaluated found = evaluate_siemens(text_.substr(at_), variables_);
    at_ += found.ok() ? found.length : found.at;
    if (!found.ok()) fail(std::move(found.problem));
    return found.value;
  }

  std::vector<double> read_indices() {
    if (peek() != '[') return {};
    SiemensIndices found = siemens_indices(text_.substr(at_), variables_);
    at_ += found.end.ok() ? found.end.length : found.end.at;
    if (!found.end.ok()) fail(std::move(found.end.problem));
    return std::move(found.values);
  }

  void check(std::string problem, std::size_t begin) {
    if (problem.empty() || !out_.ok()) return;
    at_ = begin;
    fail(std::move(problem));
  }

  /// What stands behind =.
  void read_value(const std::string& variable, const std::vector<double>& indices) {
    at_end();
    const std::size_t begin = at_;
    if (peek() == '"') {
      const std::size_t close = text_.find('"', at_ + 1);
      if (close == std::string_view::npos) return fail("the text has no closing quote");
      std::string text(text_.substr(at_ + 1, close - at_ - 1));
      at_ = close + 1;
      if (variables_ != nullptr) check(variables_->assign_text(variable, std::move(text)), begin);
      return;
    }
    const std::string word = name();
    const bool row = word == "SET";
    if ((row || word == "REP") && take('(')) return read_row(variable, indices, row);
    at_ = begin;
    const double number = value();
    if (variables_ != nullptr && out_.ok()) {
      check(variables_->assign(variable, indices, number), begin);
    }
  }

  void read_row(const std::string& variable, const std::vector<double>& indices, bool row) {
    const std::size_t begin = at_;
    std::vector<double> values;
    do {
      values.push_back(value());
    } while (out_.ok() && row && take(','));
    if (out_.ok() && !take(')')) return fail("the parenthesis is not closed");
    if (!out_.ok() || variables_ == nullptr) return;
    check(row ? variables_->assign_row(variable, indices, values)
              : variables_->fill(variable, indices, values.front()),
          begin);
  }

  void declare(SiemensType type, std::vector<std::string>* names) {
    const std::string variable_name = name();
    if (variable_name.empty() || variable_name[0] == '$' || is_r_parameter(variable_name)) {
      return fail("a name is missing");
    }
    SiemensVariable variable;
    variable.type = type;
    double cells = 1.0;
    for (const double extent : read_indices()) {
      if (variables_ == nullptr) continue;
      cells *= extent;
      if (!(extent >= 1.0) || extent != std::trunc(extent) || !(cells <= kMostCells)) {
        return fail("an array has from 1 to 10000 places");
      }
      variable.extents.push_back(static_cast<std::size_t>(extent));
    }
    if (!out_.ok()) return;
    variable.cells.assign(static_cast<std::size_t>(cells), 0.0);
    if (names != nullptr) names->push_back(variable_name);
    const std::vector<double> first(variable.extents.size(), 0.0);
    if (variables_ != nullptr) {
      check(variables_->declare(variable_name, std::move(variable)), at_);
    }
    if (out_.ok() && take('=')) read_value(variable_name, first);
  }

  void parameter(SiemensProcedure& out) {
    const std::string word = name();
    const std::optional<SiemensType> type = type_of(word);
    if (!type || type == SiemensType::text) {
      return fail("a parameter of the kind \"" + word + "\" is not read; REAL, INT and BOOL are");
    }
    SiemensVariable variable;
    variable.type = *type;
    const std::string parameter_name = name();
    if (parameter_name.empty() || peek() == '[') return fail("a parameter is no plain name");
    if (take('=')) {
      const std::size_t begin = at_;
      SiemensVariables alone;
      alone.declare(parameter_name, variable);
      const Evaluated found = evaluate_siemens(text_.substr(at_), &alone);
      if (!found.ok()) return fail(found.problem);
      at_ += found.length;
      check(alone.assign(parameter_name, {}, found.value), begin);
      variable.cells[0] = alone.value(parameter_name, {}).value;
    }
    out.parameters.emplace_back(parameter_name, std::move(variable));
  }

  std::string_view text_;
  SiemensVariables* variables_;
  std::size_t at_ = 0;
  Evaluated out_;
};

}  // namespace

Evaluated assign_siemens(std::string_view text, SiemensVariables* variables) {
  return Reader(text, variables).assignment();
}

Evaluated declare_siemens(std::string_view text, SiemensVariables* variables,
                          std::vector<std::string>* names) {
  return Reader(text, variables).declaration(names);
}

SiemensProcedure read_siemens_procedure(std::string_view text) {
  return Reader(text, nullptr).procedure();
}

std::optional<std::string> siemens_text(std::string_view text, const SiemensVariables& variables) {
  std::string out;
  std::size_t at = 0;
  const auto skip = [&] {
    while (at < text.size() && detail::is_blank(text[at])) ++at;
  };
  while (true) {
    skip();
    if (at == text.size()) return std::nullopt;
    if (text[at] == '"') {
      const std::size_t close = text.find('"', at + 1);
      if (close == std::string_view::npos) return std::nullopt;
      out += text.substr(at + 1, close - at - 1);
      at = close + 1;
    } else {
      std::size_t end = at;
      while (end < text.size() && in_name(text[end])) ++end;
      const auto named = variables.text(upper_text(text.substr(at, end - at)));
      if (named) {
        out += *named;
        at = end;
      } else {
        const std::size_t stop = std::min(text.find("<<", at), text.size());
        const Evaluated found = evaluate_siemens(text.substr(at, stop - at), &variables);
        if (!found.ok()) return std::nullopt;
        out += shortest_text(found.value);
        at += found.length;
      }
    }
    skip();
    if (at == text.size()) return out;
    if (text.substr(at, 2) != "<<") return std::nullopt;
    at += 2;
  }
}

}  // namespace smoothpost::nc

#include "formats/nc/siemens_variables.h"

#include <algorithm>
#include <cmath>

#include "formats/nc/number_text.h"
#include "formats/nc/siemens_words.h"

namespace smoothpost::nc {
namespace {

constexpr double kMostInteger = 2147483647.0;
constexpr double kMostParameter = 99999.0;
constexpr std::size_t kMostCells = 1'000'000;

/// The cell that indices mean; `problem` says why there is none.
struct Cell {
  std::size_t number = 0;
  std::string problem;
};

Cell cell_of(const SiemensVariable& variable, const std::vector<double>& indices) {
  if (indices.size() != variable.extents.size()) {
    return {0, variable.extents.empty() ? "it is no array"
                                        : "it is an array of as many indices as "
                                          "its DEF has"};
  }
  Cell cell;
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const double index = indices[i];
    if (index != std::trunc(index) || index < 0.0 ||
        !(index < static_cast<double>(variable.extents[i]))) {
      return {0, "the index " + shortest_text(index) + " is no whole number from 0 to " +
                     std::to_string(variable.extents[i] - 1)};
    }
    cell.number = cell.number * variable.extents[i] + static_cast<std::size_t>(index);
  }
  return cell;
}

/// R[5] is R5. A name without indices is as it is.
std::string resolved(const std::string& name, const std::vector<double>& indices) {
  if (name != "R" || indices.size() != 1) return name;
  const double index = indices.front();
  const bool good = index == std::trunc(index) && index >= 0.0 && index <= kMostParameter;
  return good ? "R" + std::to_string(std::lround(index)) : name;
}

std::string convert(SiemensType type, double& value) {
  if (!std::isfinite(value)) return "the value is no finite number";
  if (type == SiemensType::text) return "a text takes no number";
  if (type == SiemensType::boolean) value = value != 0.0 ? 1.0 : 0.0;
  if (type != SiemensType::integer) return {};
  value = std::floor(value + 0.5);
  return std::abs(value) > kMostInteger ? "the value is too large for INT" : std::string();
}

std::string unknown(const std::string& name) {
  if (name[0] == '$') return name + " is a system variable, which is not read";
  return name + " has no value: no variable of that name was declared before";
}

}  // namespace

SiemensVariable* SiemensVariables::find(const std::string& name) {
  if (is_r_parameter(name)) return &parameters_[name];
  const auto found = levels_.back().find(name);
  return found == levels_.back().end() ? nullptr : &found->second;
}

const SiemensVariable* SiemensVariables::find(const std::string& name) const {
  static const SiemensVariable kZero{};
  const bool parameter = is_r_parameter(name);
  const Level& level = parameter ? parameters_ : levels_.back();
  const auto found = level.find(name);
  if (found != level.end()) return &found->second;
  return parameter ? &kZero : nullptr;
}

ParameterValue SiemensVariables::value(const std::string& written,
                                       const std::vector<double>& indices) const {
  const std::string name = resolved(written, indices);
  const SiemensVariable* variable = find(name);
  if (variable == nullptr) return {0.0, unknown(name)};
  if (variable->type == SiemensType::text) return {0.0, name + " is a text"};
  if (!variable->certain) {
    return {0.0, name +
                     " counted a FOR loop, and what it holds behind ENDFOR is not stated; "
                     "assign it again"};
  }
  const Cell cell = cell_of(*variable, name == written ? indices : std::vector<double>{});
  if (!cell.problem.empty()) return {0.0, name + ": " + cell.problem};
  return {variable->cells[cell.number], {}};
}

std::optional<std::string> SiemensVariables::text(const std::string& name) const {
  const SiemensVariable* variable = find(name);
  if (variable == nullptr || variable->type != SiemensType::text) return std::nullopt;
  return variable->text;
}

std::string SiemensVariables::assign(const std::string& written, const std::vector<double>& indices,
                                     double value) {
  const std::string name = resolved(written, indices);
  SiemensVariable* variable = find(name);
  if (variable == nullptr) return unknown(name);
  const Cell cell = cell_of(*variable, name == written ? indices : std::vector<double>{});
  if (!cell.problem.empty()) return name + ": " + cell.problem;
  std::string problem = convert(variable->type, value);
  if (!problem.empty()) return name + ": " + problem;
  variable->cells[cell.number] = value;
  variable->certain = true;
  return {};
}

std::string SiemensVariables::assign_row(const std::string& name,
                                         const std::vector<double>& indices,
                                         const std::vector<double>& values) {
  SiemensVariable* variable = find(name);
  if (variable == nullptr) return unknown(name);
  const Cell cell = cell_of(*variable, indices);
  if (!cell.problem.empty()) return name + ": " + cell.problem;
  if (values.size() > variable->cells.size() - cell.number) {
    return name + ": more values than the array has places";
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    double value = values[i];
    std::string problem = convert(variable->type, value);
    if (!problem.empty()) return name + ": " + problem;
    variable->cells[cell.number + i] = value;
  }
  return {};
}

std::string SiemensVariables::fill(const std::string& name, const std::vector<double>& indices,
                                   double value) {
  SiemensVariable* variable = find(name);
  if (variable == nullptr) return unknown(name);
  const Cell cell = cell_of(*variable, indices);
  if (!cell.problem.empty()) return name + ": " + cell.problem;
  std::string problem = convert(variable->type, value);
  if (!problem.empty()) return name + ": " + problem;
  std::fill(variable->cells.begin() + static_cast<std::ptrdiff_t>(cell.number),
            variable->cells.end(), value);
  return {};
}

std::string SiemensVariables::assign_text(const std::string& name, std::string text) {
  SiemensVariable* variable = find(name);
  if (variable == nullptr || variable->type != SiemensType::text) return name + " is no text";
  variable->text = std::move(text);
  return {};
}

std::string SiemensVariables::declare(const std::string& name, SiemensVariable variable) {
  Level& level = levels_.back();
  const auto old = level.find(name);
  if (old != level.end()) cells_ -= old->second.cells.size();
  cells_ += variable.cells.size();
  level[name] = std::move(variable);
  return cells_ > kMostCells ? "the variables have more than 1000000 places" : std::string();
}

void SiemensVariables::leave() {
  for (const auto& [name, variable] : levels_.back()) cells_ -= variable.cells.size();
  levels_.pop_back();
}

void SiemensVariables::forget(const std::string& name) {
  if (SiemensVariable* variable = find(name)) variable->certain = false;
}

}  // namespace smoothpost::nc

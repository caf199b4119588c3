#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "formats/nc/block_words.h"
#include "formats/nc/interpreter.h"
#include "formats/nc/parameter_store.h"
#include "formats/nc/siemens_assignment.h"

namespace smoothpost::nc {

/// Expressions and assignments of RS274NGC and of the Fanuc family: an assignment takes effect when
/// its block was read.
class Rs274Values final : public WordValues {
 public:
  /// @param dialect  linuxcnc, fanuc or haas
  Rs274Values(const InterpreterSettings& settings, InputDialect dialect, ControllerState state);

  Evaluated word(std::string_view text, WordForm form) override;
  Evaluated assign(std::string_view text) override;
  void finish_block(bool good) override;
  bool inch() const override { return modal_.unit != 1.0; }
  bool diameter() const override { return modal_.diameter; }
  bool in_cycle() const override { return is_cycle(modal_.motion); }
  Evaluated value(std::string_view text) override {
    return evaluate_value(text, store_.get(), rules_);
  }
  ParameterStore* store() override { return store_.get(); }
  void enter_call(const CallScope& scope) override { store_->enter(scope); }
  void leave_call() override { store_->leave(); }

 private:
  const ModalState& modal_;
  ExpressionRules rules_;
  std::unique_ptr<ParameterStore> store_;
  std::vector<EvaluatedAssignment> pending_;
};

/// Expressions, assignments and declarations of Sinumerik programs: they take effect from left to
/// right.
class SiemensValues final : public WordValues {
 public:
  explicit SiemensValues(const ModalState& modal) : modal_(modal) {}

  Evaluated word(std::string_view text, WordForm form) override;
  Evaluated assign(std::string_view text) override;
  void finish_block(bool) override {}
  Evaluated value(std::string_view text) override {
    return evaluate_siemens_condition(text, &variables_);
  }
  bool inch() const override { return modal_.unit != 1.0; }
  void enter_call(const CallScope& scope) override;
  void leave_call() override;
  void forget(const std::string& name) override { variables_.forget(name); }
  std::optional<std::string> text(std::string_view text) override {
    return siemens_text(text, variables_);
  }

 private:
  Evaluated bind(std::string_view text);

  const ModalState& modal_;
  SiemensVariables variables_;
  std::vector<CallScope> calls_;  ///< their arguments, by place from 0
};

}  // namespace smoothpost::nc

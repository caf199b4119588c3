#include "formats/nc/program_stream.h"

#include <cstring>
#include <utility>

#include "formats/nc/tree_builder.h"
#include "kernels/core/contract.h"

namespace smoothpost::nc {
namespace {

/// LF, CR LF and CR end lines.
std::size_t count_lines(std::string_view text) {
  std::size_t count = !text.empty() && text.back() != '\n' && text.back() != '\r' ? 1 : 0;
  const char* const end = text.data() + text.size();
  const auto each = [&](char sign, const auto& found) {
    const char* p = text.data();
    while (p != end) {
      const void* at = std::memchr(p, sign, static_cast<std::size_t>(end - p));
      if (at == nullptr) return;
      p = static_cast<const char*>(at) + 1;
      found(p);
    }
  };
  each('\n', [&](const char*) { ++count; });
  each('\r', [&](const char* behind) { count += behind == end || *behind != '\n' ? 1 : 0; });
  return count;
}

}  // namespace

ProgramStream::ProgramStream(std::string text, std::string file_name, InputDialect dialect,
                             Hooks hooks, std::size_t window)
    : hooks_(std::move(hooks)), window_(window), log_(file_name) {
  require(window > 0, "a window of at least one block");
  program_ = program_of(std::move(text), std::move(file_name), dialect, log_);
  builder_ = make_builder(program_, log_);
  builder_->read_some(window_);
  if (program_.jumps()) builder_->read_all();
  show();
}

ProgramStream::~ProgramStream() = default;

bool ProgramStream::next() {
  if (ended_) return false;
  program_.first_block += program_.blocks.size();
  program_.blocks.clear();
  program_.pieces.clear();
  builder_->read_some(window_);
  if (program_.jumps()) {
    log_ = DiagnosticLog(program_.file_name);
    program_ =
        program_of(std::move(program_.text), std::move(program_.file_name), program_.dialect, log_);
    builder_ = make_builder(program_, log_);
    builder_->read_all();
    begins_again_ = true;
  }
  show();
  return !begins_again_;
}

/// The window is complete.
void ProgramStream::show() {
  ended_ = builder_->at_end();
  if (ended_) {
    require(begins_again_ || lines_ == 0 || program_.block_count == lines_, "counted lines");
    diagnostics_ = log_.take();
  } else if (program_.first_block == 0) {
    lines_ = count_lines(program_.text);
  }
  if (!ended_) program_.block_count = lines_;
  if (hooks_.look) hooks_.look(program_);
}

const Diagnostics& ProgramStream::diagnostics() const {
  require(ended_, "the text has been read to its end");
  return diagnostics_;
}

bool ProgramStream::begins_again() {
  if (!std::exchange(begins_again_, false)) return false;
  if (hooks_.restart) hooks_.restart();
  return true;
}

}  // namespace smoothpost::nc

#include "formats/nc/program_stream.h"

#include <utility>

#include "formats/nc/tree_builder.h"
#include "kernels/core/contract.h"

namespace smoothpost::nc {

ProgramStream::ProgramStream(std::string text, std::string file_name, InputDialect dialect,
                             std::size_t window, const Look& look)
    : window_(window), unused_(file_name) {
  require(window > 0, "a window of at least one block");
  DiagnosticLog log(file_name);
  program_ = program_of(std::move(text), std::move(file_name), dialect, log);
  survey(log, look);
  rewind();
}

ProgramStream::~ProgramStream() = default;

void ProgramStream::survey(DiagnosticLog& log, const Look& look) {
  builder_ = make_builder(program_, log);
  builder_->read_some(window_);
  while (!builder_->at_end() && !program_.jumps()) {
    if (look) look(program_);
    clear_window();
    builder_->read_some(window_);
  }
  if (program_.jumps() && program_.first_block != 0) {
    // What the windows before have told comes again.
    DiagnosticLog fresh(program_.file_name);
    program_ = program_of(std::move(program_.text), std::move(program_.file_name), program_.dialect,
                          fresh);
    builder_ = make_builder(program_, fresh);
    builder_->read_all();
    diagnostics_ = fresh.take();
  } else {
    builder_->read_all();
    diagnostics_ = log.take();
  }
  if (look) look(program_);
}

void ProgramStream::clear_window() {
  program_.first_block += program_.blocks.size();
  program_.blocks.clear();
  program_.pieces.clear();
}

void ProgramStream::rewind() {
  if (program_.first_block == 0) return;
  program_.blocks.clear();
  program_.pieces.clear();
  program_.first_block = 0;
  builder_ = make_builder(program_, unused_);
  builder_->read_again();
  builder_->read_some(window_);
}

bool ProgramStream::next() {
  if (program_.first_block + program_.blocks.size() == program_.block_count) return false;
  clear_window();
  builder_->read_some(window_);
  return true;
}

}  // namespace smoothpost::nc

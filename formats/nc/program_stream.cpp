#include "formats/nc/program_stream.h"

#include <algorithm>
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
                             Hooks hooks, std::size_t window, std::size_t kept)
    : hooks_(std::move(hooks)), window_(window), most_kept_(kept), log_(file_name) {
  require(window > 0, "a window of at least one block");
  program_ = program_of(std::move(text), std::move(file_name), dialect, log_);
  builder_ = make_builder(program_, log_);
  builder_->read_some(window_);
  if (program_.jumps()) {
    read_parts();
  } else {
    show();
  }
}

ProgramStream::~ProgramStream() = default;

bool ProgramStream::next() {
  if (ended_) return false;
  program_.first_block += program_.blocks.size();
  program_.blocks.clear();
  program_.pieces.clear();
  builder_->read_some(window_);
  if (program_.jumps()) {
    begins_again_ = true;
    read_parts();
    return false;
  }
  show();
  return true;
}

/// The window is complete.
void ProgramStream::show() {
  ended_ = builder_->at_end();
  if (ended_) {
    require(lines_ == 0 || program_.block_count == lines_, "counted lines");
    diagnostics_ = log_.take();
  } else if (program_.first_block == 0) {
    lines_ = count_lines(program_.text);
  }
  if (!ended_) program_.block_count = lines_;
  if (hooks_.look) hooks_.look(program_);
}

/// Reads the text of a program that jumps from its beginning to its end.
void ProgramStream::read_parts() {
  constexpr std::size_t kSmaller = 8;
  window_ = std::max<std::size_t>(window_ / kSmaller, 1);
  log_ = DiagnosticLog(program_.file_name);
  program_ =
      program_of(std::move(program_.text), std::move(program_.file_name), program_.dialect, log_);
  builder_ = make_builder(program_, log_);
  FlowIndexer indexer(program_.dialect);
  lines_ = count_lines(program_.text);
  do {
    const std::size_t first_block = program_.first_block + program_.blocks.size();
    if (!parts_.empty()) keep();
    part_ = parts_.size();
    program_.first_block = first_block;
    program_.blocks.clear();
    program_.pieces.clear();
    parts_.push_back({program_.first_block, builder_->clone()});
    parts_.back().builder->read_again();
    builder_->read_some(window_);
    indexer.add(program_);
    program_.block_count = lines_;
    if (hooks_.look) hooks_.look(program_);
  } while (!builder_->at_end());
  require(program_.first_block + program_.blocks.size() == lines_, "counted lines");
  diagnostics_ = log_.take();
  ended_ = true;
  flow_ = indexer.finish(lines_);
  show_part(0);
}

void ProgramStream::go_to(std::size_t block) {
  require(jumps() && block < lines_, "a block of a program that jumps");
  const auto behind = std::upper_bound(
      parts_.begin(), parts_.end(), block,
      [](std::size_t value, const Part& part) { return value < part.first_block; });
  show_part(static_cast<std::size_t>(behind - parts_.begin()) - 1);
}

void ProgramStream::show_part(std::size_t part) {
  if (part == part_) return;
  const auto found = std::find_if(kept_.begin(), kept_.end(),
                                  [part](const Kept& kept) { return kept.part == part; });
  if (found != kept_.end()) {
    found->blocks.swap(program_.blocks);
    found->pieces.swap(program_.pieces);
    found->part = part_;
    found->used = ++shown_;
  } else {
    keep();
    program_.blocks.clear();
    program_.pieces.clear();
    parts_[part].builder->clone()->read_some(window_);
    program_.block_count = lines_;
  }
  part_ = part;
  program_.first_block = parts_[part].first_block;
}

/// The window, which may then be cleared, in the place of the one that was shown longest ago.
void ProgramStream::keep() {
  if (most_kept_ == 0) return;
  if (kept_.size() < most_kept_) {
    kept_.push_back({part_, ++shown_, std::move(program_.blocks), std::move(program_.pieces)});
    program_.blocks = {};
    program_.pieces = {};
    return;
  }
  Kept& oldest = *std::min_element(kept_.begin(), kept_.end(),
                                   [](const Kept& a, const Kept& b) { return a.used < b.used; });
  oldest.part = part_;
  oldest.used = ++shown_;
  oldest.blocks.swap(program_.blocks);
  oldest.pieces.swap(program_.pieces);
}

FlowIndex ProgramStream::take_flow() {
  require(flow_.has_value(), "the flow of a program that jumps, once");
  FlowIndex flow = std::move(*flow_);
  flow_.reset();
  return flow;
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

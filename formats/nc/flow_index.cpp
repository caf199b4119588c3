#include "formats/nc/flow_index.h"

#include <algorithm>
#include <tuple>
#include <unordered_set>

#include "formats/nc/number.h"
#include "formats/nc/siemens_flow.h"
#include "formats/nc/siemens_words.h"
#include "kernels/core/contract.h"

namespace smoothpost::nc {
namespace {

using Kind = FlowKind;
constexpr std::uint32_t kNone = FlowStatement::kNone;
constexpr std::size_t kDeepest = 100;  // loops and branches within each other

const char* keyword_of(Kind kind) {
  constexpr const char* kNames[] = {
      "sub",       "endsub", "call",   "return",  "while",  "endwhile", "do",       "repeat",
      "endrepeat", "if",     "elseif", "else",    "endif",  "break",    "continue", "GOTO",
      "IF",        "IF",     "WHILE",  "DO",      "END",    "GOTO",     "IF",       "CASE",
      "FOR",       "ENDFOR", "LOOP",   "ENDLOOP", "REPEAT", "UNTIL",    "REPEAT",   "call"};
  return kNames[static_cast<std::size_t>(kind)];
}

/// What must be open for `kind`: the kinds that it can close or continue.
bool fits(Kind kind, Kind open) {
  switch (kind) {
    case Kind::endsub:
      return open == Kind::sub;
    case Kind::endwhile:
      return open == Kind::loop_while;
    case Kind::endrepeat:
      return open == Kind::repeat;
    case Kind::elseif:
    case Kind::otherwise:
    case Kind::endif:
      return open == Kind::branch_if || open == Kind::elseif ||
             (open == Kind::otherwise && kind == Kind::endif);
    case Kind::macro_end:
      return open == Kind::macro_while || open == Kind::macro_do;
    case Kind::endfor:
      return open == Kind::counted_for;
    case Kind::endloop:
      return open == Kind::endless_loop;
    case Kind::until:
      return open == Kind::repeat_until;
    default:
      return false;
  }
}

class Pairing {
 public:
  explicit Pairing(FlowIndex& index) : index_(index) {}

  void add(FlowStatement statement) {
    const auto number = static_cast<std::uint32_t>(index_.statements.size());
    index_.statements.push_back(std::move(statement));
    switch (now(number).text.kind) {
      case Kind::sub:
        return open_sub(number);
      case Kind::loop_while:
        if (closes_do(number)) return;
        return open(number);
      case Kind::loop_do:
      case Kind::repeat:
      case Kind::branch_if:
      case Kind::macro_while:
      case Kind::macro_do:
      case Kind::counted_for:
      case Kind::endless_loop:
      case Kind::repeat_until:
        return open(number);
      case Kind::endsub:
      case Kind::endwhile:
      case Kind::endrepeat:
      case Kind::endif:
      case Kind::macro_end:
      case Kind::endfor:
      case Kind::endloop:
      case Kind::until:
      case Kind::elseif:
      case Kind::otherwise:
        return close(number);
      case Kind::give_back:
        if (sub_ == kNone) now(number).fault = "return stands in no subroutine";
        return;
      case Kind::leave:
      case Kind::next:
        return find_loop(number);
      default:
        return;
    }
  }

  /// A program number of the Fanuc style begins another text.
  void end_region() {
    finish();
    used_.clear();
  }

  void finish() {
    for (const std::uint32_t number : open_) unclosed(number);
    open_.clear();
    sub_ = kNone;
  }

 private:
  FlowStatement& now(std::uint32_t number) { return index_.statements[number]; }

  void unclosed(std::uint32_t number) {
    // An elseif or else stands for its if.
    now(number).fault = std::string(keyword_of(now(number).text.kind)) + " has no end";
  }

  void open(std::uint32_t number) {
    // Those of siemens have no labels.
    const bool macro = now(number).text.kind == Kind::macro_while ||
                       now(number).text.kind == Kind::macro_do || now(number).text.label.empty();
    // Loop numbers of macros are used again and again, but not within each other.
    bool fresh = true;
    if (macro) {
      for (const std::uint32_t other : open_) {
        fresh = fresh &&
                (now(other).text.label != now(number).text.label || now(number).text.label.empty());
      }
    } else {
      fresh = used_.insert(now(number).text.label).second;
    }
    if (!fresh) {
      now(number).fault = "the label " + now(number).text.label +
                          " is used before in the same program or subroutine";
    }
    if (open_.size() >= kDeepest) {
      now(number).fault = "more than 100 loops and branches within each other";
      return;
    }
    open_.push_back(number);
  }

  void open_sub(std::uint32_t number) {
    FlowStatement& statement = now(number);
    if (!open_.empty()) {
      statement.fault = sub_ != kNone ? "a subroutine within a subroutine"
                                      : "a subroutine within a loop or branch";
    }
    if (!index_.subs.emplace(statement.text.label, number).second) {
      statement.fault = "the subroutine " + statement.text.label + " is defined before";
    }
    outer_used_.swap(used_);
    used_.clear();
    open_.push_back(number);
    sub_ = number;
  }

  bool closes_do(std::uint32_t number) {
    if (open_.empty()) return false;
    const std::uint32_t last = open_.back();
    if (now(last).text.kind != Kind::loop_do || now(last).text.label != now(number).text.label) {
      return false;
    }
    now(number).closes_do = true;
    pair(last, number);
    open_.pop_back();
    return true;
  }

  void pair(std::uint32_t begin, std::uint32_t end) {
    now(begin).partner = end;
    now(end).partner = begin;
  }

  void close(std::uint32_t number) {
    FlowStatement& statement = now(number);
    const Kind kind = statement.text.kind;
    if (open_.empty()) {
      statement.fault = std::string(keyword_of(kind)) + " closes nothing";
      return;
    }
    const std::uint32_t last = open_.back();
    if (!fits(kind, now(last).text.kind) || now(last).text.label != statement.text.label) {
      const auto with_label = [](const FlowText& text) {
        return std::string(keyword_of(text.kind)) +
               (text.label.empty() ? "" : " with label " + text.label);
      };
      statement.fault = with_label(statement.text) + " does not fit the " +
                        with_label(now(last).text) + " that is open";
      // What it was meant to close is closed too, so that one fault is one message.
      while (kind == Kind::endsub && !open_.empty()) pop();
      return;
    }
    if (kind == Kind::elseif || kind == Kind::otherwise) {
      now(last).partner = number;
      chain_[number] = chain_.count(last) != 0 ? chain_[last] : last;
      open_.back() = number;
      return;
    }
    if (kind == Kind::endif) {
      now(last).partner = number;
      for (std::uint32_t k = chain_.count(last) != 0 ? chain_[last] : last; k != number;
           k = now(k).partner) {
        now(k).end = number;
      }
    } else {
      pair(last, number);
    }
    pop();
  }

  void pop() {
    if (now(open_.back()).text.kind == Kind::sub) {
      sub_ = kNone;
      used_.swap(outer_used_);
      outer_used_.clear();
    }
    open_.pop_back();
  }

  void find_loop(std::uint32_t number) {
    FlowStatement& statement = now(number);
    for (auto it = open_.rbegin(); it != open_.rend(); ++it) {
      const FlowStatement& loop = now(*it);
      const bool fits = loop.text.kind == Kind::loop_while || loop.text.kind == Kind::loop_do;
      if (fits && loop.text.label == statement.text.label) {
        statement.partner = *it;
        return;
      }
    }
    statement.fault = std::string(keyword_of(statement.text.kind)) +
                      " stands in no while or do loop of its label";
  }

  FlowIndex& index_;
  std::vector<std::uint32_t> open_;
  std::unordered_map<std::uint32_t, std::uint32_t> chain_;  ///< elseif, else -> their if
  std::unordered_set<std::string> used_;
  std::unordered_set<std::string> outer_used_;
  std::uint32_t sub_ = kNone;
};

bool is_oword(Kind kind) { return kind < Kind::macro_goto; }

FlowText read(const Program& program, const Piece& piece) {
  const std::string_view text = std::string_view(program.text).substr(piece.begin, piece.length);
  if (program.dialect == InputDialect::siemens) return read_siemens_flow(text);
  return is_oword(static_cast<Kind>(piece.detail)) ? read_o_line(text) : read_macro_line(text);
}

std::string_view text_of(const Program& program, const Piece& piece) {
  return std::string_view(program.text).substr(piece.begin, piece.length);
}

/// NAME: of a Sinumerik program.
bool is_label(const Program& program, const Piece& piece) {
  return program.dialect == InputDialect::siemens && piece.kind == PieceKind::statement &&
         text_of(program, piece).back() == ':';
}

std::string label_name(const Program& program, const Piece& piece) {
  std::string name = upper_text(text_of(program, piece));
  name.pop_back();
  while (!name.empty() && detail::is_blank(name.back())) name.pop_back();
  return name;
}

/// The programs of a Sinumerik text.
class Sections {
 public:
  explicit Sections(std::vector<FlowIndex::Section>& sections) : sections_(sections) {
    sections_.emplace_back();
  }

  /// A line %_N_NAME_SPF. True: another program begins.
  bool header(std::string_view text, std::uint32_t block) {
    std::string name = upper_text(text.substr(4));
    while (!name.empty() && detail::is_blank(name.back())) name.pop_back();
    const bool subprogram = name.ends_with("_SPF");
    name.resize(name.size() - 4);
    const bool fresh = begin(block);
    set_name(std::move(name), subprogram);
    return fresh;
  }

  /// PROC. True: another program begins.
  bool procedure(std::string_view text, std::uint32_t block, bool further) {
    const bool fresh = further && begin(block);
    if (fresh || sections_.back().name.empty()) {
      std::size_t at = 4;
      while (at < text.size() && detail::is_blank(text[at])) ++at;
      std::size_t end = at;
      while (end < text.size() && text[end] != '(' && !detail::is_blank(text[end])) ++end;
      set_name(upper_text(text.substr(at, end - at)), true);
    }
    sections_.back().procedure = true;
    used_ = true;
    return fresh;
  }

  void use() { used_ = true; }
  void finish(std::uint32_t blocks) { sections_.back().end = blocks; }

 private:
  bool begin(std::uint32_t block) {
    const bool fresh = used_;
    if (fresh) {
      sections_.back().end = block;
      sections_.emplace_back();
      sections_.back().begin = block;
    }
    used_ = false;
    return fresh;
  }

  void set_name(std::string name, bool subprogram) {
    FlowIndex::Section& now = sections_.back();
    now.subprogram = subprogram;
    now.name = std::move(name);
    used_ = used_ || now.begin != 0;
  }

  std::vector<FlowIndex::Section>& sections_;
  bool used_ = false;
};

bool is_section(const Piece& piece) {
  return piece.kind == PieceKind::statement &&
         (piece.detail == static_cast<std::uint8_t>(SiemensWord::program_name) ||
          piece.detail == static_cast<std::uint8_t>(SiemensWord::procedure) ||
          piece.detail == static_cast<std::uint8_t>(SiemensWord::further_procedure));
}

/// True: another program begins with this piece.
bool add_section(Sections& sections, const Program& program, const Piece& piece,
                 std::uint32_t block) {
  const std::string_view text = text_of(program, piece);
  const auto word = static_cast<SiemensWord>(piece.detail);
  if (word == SiemensWord::program_name) return sections.header(text, block);
  return sections.procedure(text, block, word == SiemensWord::further_procedure);
}

}  // namespace

const FlowIndex::Section& FlowIndex::section_of(std::uint32_t block) const {
  const auto behind =
      std::upper_bound(sections.begin(), sections.end(), block,
                       [](std::uint32_t value, const Section& s) { return value < s.begin; });
  return behind == sections.begin() ? sections.front() : behind[-1];
}

const FlowIndex::Section* FlowIndex::section(const std::string& name) const {
  for (const Section& s : sections)
    if (s.name == name) return &s;
  return nullptr;
}

std::uint32_t FlowIndex::of_block(std::uint32_t block) const {
  const auto found = std::lower_bound(
      statements.begin(), statements.end(), block,
      [](const FlowStatement& statement, std::uint32_t value) { return statement.block < value; });
  return static_cast<std::uint32_t>(found - statements.begin());
}

std::uint32_t FlowIndex::region_of(std::uint32_t block) const {
  const auto behind = std::upper_bound(regions.begin(), regions.end(), block);
  return behind == regions.begin() ? 0 : behind[-1];
}

std::vector<std::uint32_t> FlowIndex::numbered(std::uint32_t region, long number) const {
  const auto key = [](const Numbered& n) { return std::tuple(n.region, n.number); };
  auto it = std::lower_bound(
      numbers.begin(), numbers.end(), std::tuple(region, number),
      [&](const Numbered& n, const std::tuple<std::uint32_t, long>& k) { return key(n) < k; });
  std::vector<std::uint32_t> out;
  for (; it != numbers.end() && key(*it) == std::tuple(region, number) && out.size() < 2; ++it) {
    out.push_back(it->block);
  }
  return out;
}

struct FlowIndexer::State {
  explicit State(InputDialect dialect)
      : numbers(dialect != InputDialect::linuxcnc),
        siemens(dialect == InputDialect::siemens),
        sections(index.sections) {}

  void take(const Program& program, const Block& block, std::uint32_t number);
  void take(const Program& program, const Block& block, const Piece& piece, std::uint32_t number);

  bool numbers, siemens;
  FlowIndex index;
  Pairing pairing{index};
  Sections sections;  ///< siemens
  std::uint32_t region = 0;
};

void FlowIndexer::State::take(const Program& program, const Block& block, std::uint32_t number) {
  for (std::uint32_t i = block.first_piece; i < block.first_piece + block.piece_count; ++i)
    take(program, block, program.pieces[i], number);
}

void FlowIndexer::State::take(const Program& program, const Block& block, const Piece& piece,
                              std::uint32_t number) {
  if (siemens && is_section(piece)) {
    if (!add_section(sections, program, piece, number)) return;
    pairing.end_region();
    region = number;
    return;
  }
  if (siemens && piece.kind != PieceKind::space && piece.kind != PieceKind::line_end &&
      piece.kind != PieceKind::comment) {
    sections.use();
  }
  if (piece.kind == PieceKind::flow) {
    FlowStatement statement;
    statement.text = read(program, piece);
    statement.block = number;
    statement.begin = piece.begin;
    statement.length = piece.length;
    statement.column = piece.begin - program.pieces[block.first_piece].begin + 1;
    pairing.add(std::move(statement));
  } else if (piece.kind == PieceKind::word && piece.letter == 'O') {
    region = number;
    const auto [label, fresh] =
        index.programs.insert({label_number(piece.value), FlowIndex::ProgramLabel{number, false}});
    if (!fresh) label->second.twice = true;
    index.regions.push_back(number);
    if (numbers) pairing.end_region();
  } else if (is_label(program, piece)) {
    index.labels[label_name(program, piece)].push_back(number);
  } else if (numbers && piece.kind == PieceKind::word && piece.letter == 'N') {
    index.numbers.push_back({region, label_number(piece.value), number});
  }
}

FlowIndexer::FlowIndexer(InputDialect dialect) : state_(std::make_unique<State>(dialect)) {}

FlowIndexer::~FlowIndexer() = default;

void FlowIndexer::add(const Program& window) {
  for (std::size_t b = 0; b < window.blocks.size(); ++b)
    state_->take(window, window.blocks[b], static_cast<std::uint32_t>(window.first_block + b));
}

FlowIndex FlowIndexer::finish(std::size_t blocks) {
  FlowIndex& index = state_->index;
  state_->pairing.finish();
  if (state_->siemens) {
    state_->sections.finish(static_cast<std::uint32_t>(blocks));
  } else {
    index.sections.clear();
  }
  std::sort(index.numbers.begin(), index.numbers.end(),
            [](const FlowIndex::Numbered& a, const FlowIndex::Numbered& b) {
              return std::tuple(a.region, a.number, a.block) <
                     std::tuple(b.region, b.number, b.block);
            });
  // The end of the loop that break and continue belong to was not known before.
  for (FlowStatement& statement : index.statements) {
    const bool leaves = statement.text.kind == Kind::leave || statement.text.kind == Kind::next;
    if (leaves && statement.partner != kNone) {
      statement.end = index.statements[statement.partner].partner;
      if (statement.end == kNone) statement.fault = "the loop has no end";
    }
  }
  return std::move(index);
}

FlowIndex index_flow(const Program& program) {
  require(program.is_whole(), "the flow of a whole program");
  FlowIndexer indexer(program.dialect);
  indexer.add(program);
  return indexer.finish(program.block_count);
}

}  // namespace smoothpost::nc

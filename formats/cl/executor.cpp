#include "formats/cl/executor.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "formats/nc/number_text.h"
#include "kernels/core/units.h"

namespace smoothpost::cl {
namespace {

constexpr double kLargest = 1.0e6;  // mm
constexpr std::size_t kBinaryProbe = 65536;

}  // namespace

Executor::Executor(std::string_view text, const std::string& file_name,
                   const ReaderSettings& settings, CanonicalSink& sink)
    : settings_(settings),
      sink_(sink),
      log_(file_name),
      text_(text),
      scanner_(text, &log_),
      rows_(settings.process),
      unit_(settings.unit) {
  if (settings.feed) feed_ = Feed{*settings.feed, false};
}

Result<ReadingSummary> Executor::run() {
  if (!is_binary()) {
    while (scanner_.next()) {
      if (summary_.ended) {
        if (note_after_end(scanner_.statement())) break;
        continue;
      }
      execute(scanner_.statement());
    }
    finish();
  }
  summary_.lines = scanner_.line();
  if (log_.has_error()) return Result<ReadingSummary>::failure(log_.take());
  return {std::move(summary_), log_.take()};
}

bool Executor::is_binary() {
  if (text_.substr(0, kBinaryProbe).find('\0') == std::string_view::npos) return false;
  log_.error("CL106",
             "a binary CL file; let the CAM system write it as text (of NCL: .as, APT source)",
             {1, 1});
  return true;
}

void Executor::execute(const Statement& statement) {
  if (statement.kind == Statement::Kind::values) return arc_values(statement);
  finish_arc();
  if (statement.kind == Statement::Kind::comment) return comment_statement(statement);
  catia_lines_ = -1;
  if (statement.kind == Statement::Kind::bad) return lose(statement);
  path_ended_ = false;
  const Word word = statement.word();
  const bool process = word == Word::unknown || (word >= Word::spindl && word <= Word::no_effect);
  if (!process || !rows_.knows(statement.major) || !act_on_row(statement)) act(statement);
  comment(statement.trailing, statement.place);
}

void Executor::act(const Statement& statement) {
  switch (statement.word()) {
    case Word::go_to:
      return go_to(statement);
    case Word::from:
      return from(statement);
    case Word::godlta:
      return go_delta(statement);
    case Word::circle:
      return begin_circle(statement);
    case Word::indirv:
      return forward_direction(statement);
    case Word::tlon:
      return tlon(statement);
    case Word::cycle:
      return cycle(statement);
    case Word::spindl:
      return spindle(statement);
    case Word::loadtl:
      return load_tool(statement, 0);
    case Word::load:
      return load(statement);
    case Word::select:
      return select(statement);
    case Word::toolno:
      return describe_tool(statement);
    case Word::coolnt:
      return coolant(statement);
    case Word::cutcom:
      return cutter_compensation(statement);
    case Word::delay:
      return dwell(statement);
    case Word::stop:
      return event(event_name::kStop, statement);
    case Word::opstop:
      return event(event_name::kOptionalStop, statement);
    case Word::text:
      return comment(statement.text, statement.place);
    case Word::description:
      return comment(scanner_.written(), statement.place);
    case Word::insert:
    case Word::unknown:
      return unmapped(statement);
    default:
      return act_on_mode(statement);
  }
}

void Executor::act_on_mode(const Statement& statement) {
  switch (statement.word()) {
    case Word::rapid:
      if (read_numbers(statement, {0}, "RAPID")) rapid_ = true;
      return;
    case Word::fedrat:
      return set_feed(statement);
    case Word::units:
      return set_units(statement);
    case Word::multax:
      return set_multax(statement);
    case Word::tlaxis:
      return set_tool_axis(statement);
    case Word::msys:
      return frame_by_axes(statement);
    case Word::csys:
      return frame_by_matrix(statement);
    case Word::trntyp:
      return transformation_type(statement);
    case Word::end_of_path:
      path_ended_ = true;
      circle_without_end(statement.place);
      return;
    case Word::end:
    case Word::fini:
      circle_without_end(statement.place);
      summary_.ended = true;
      return sink_.program_end(statement.place.line);
    case Word::refused:
      error("CL150",
            std::string(statement.info->name) + " is not read: it " +
                std::string(statement.info->reason),
            statement.place);
      return;
    default:
      return;  // no_effect
  }
}

void Executor::finish() {
  finish_arc();
  const TextPlace end{scanner_.line(), 0};
  if (summary_.ended) return;
  circle_without_end(end);
  if (!path_ended_)
    log_.warning("CL162", "the text ends without FINI, END or END-OF-PATH: it may be cut short",
                 end);
}

/// True when nothing more is to be read.
bool Executor::note_after_end(const Statement& statement) {
  if (statement.word() == Word::fini) return true;
  if (statement.kind == Statement::Kind::comment || statement.word() == Word::text ||
      statement.word() == Word::no_effect)
    return false;
  log_.note("CL163", "the program has ended; the lines from here on are not read", statement.place);
  return true;
}

void Executor::set_units(const Statement& statement) {
  std::string_view word;
  if (!only_word(statement, word, "UNITS/MM or UNITS/INCHES")) return;
  unit_given_ = true;
  if (same_word(word, "MM")) {
    unit_ = 1.0;
  } else if (same_word(word, "CM")) {
    unit_ = 10.0;
  } else if (same_word(word, "IN") || same_word(word, "INCH") || same_word(word, "INCHES")) {
    unit_ = kMillimetresPerInch;
  } else {
    error("CL111", "the unit " + quoted(word) + " is not read; write UNITS/MM or UNITS/INCHES",
          statement.items.front().place);
  }
}

void Executor::set_multax(const Statement& statement) {
  if (statement.items.empty()) {
    locked_axis_ = false;
    return;
  }
  std::string_view word;
  if (!only_word(statement, word, "MULTAX, MULTAX/ON or MULTAX/OFF")) return;
  if (same_word(word, "ON") || same_word(word, "OFF")) {
    locked_axis_ = same_word(word, "OFF");
  } else {
    error("CL110", "MULTAX/" + std::string(word.substr(0, 20)) + ": expected is ON or OFF",
          statement.items.front().place);
  }
}

void Executor::set_tool_axis(const Statement& statement) {
  if (!read_numbers(statement, {3}, "TLAXIS/i,j,k")) return;
  if (const auto axis = tool_axis(statement, 0)) position_.axis = *axis;
}

void Executor::set_feed(const Statement& statement) {
  FeedUnit unit{true, false, 0.0};
  bool unit_given = false;
  const Item* number = nullptr;
  for (const Item& item : statement.items) {
    if (item.kind == Item::Kind::number && number == nullptr) {
      number = &item;
      continue;
    }
    const FeedUnit found = item.kind == Item::Kind::word ? feed_unit(item.text) : FeedUnit{};
    if (!found.known || unit_given) {
      error("CL115",
            "FEDRAT with " + quoted(item.text) +
                " is not read; expected is FEDRAT/v with MMPM, IPM, PERMIN, MMPR, IPR or PERREV",
            item.place);
      return;
    }
    unit = found;
    unit_given = true;
  }
  if (number == nullptr || !(number->value > 0.0)) {
    error("CL115", "FEDRAT needs a feed above 0", number ? number->place : statement.place);
    return;
  }
  if (unit.length == 0.0 && !length_unit(statement.place)) return;
  const Feed feed = feed_of(number->value, unit, unit_.value_or(1.0));
  if (!usable(feed)) {
    error("CL115",
          "the feed " + quoted(number->text) + " is outside 0.000001 to 1000000 mm/s or mm/rev",
          number->place);
    return;
  }
  feed_ = feed;
  feed_given_ = true;
  if (!rapid_) return;
  rapid_ = false;
  log_.warning("CL164", "FEDRAT stands between RAPID and its motion: the motion is a feed",
               statement.place);
}

// ---- values of a statement ----------------------------------------------------------------------

bool Executor::read_numbers(const Statement& statement, std::initializer_list<std::size_t> counts,
                            const char* form) {
  const auto& items = statement.items;
  if (!numbers_from(items, form)) return false;
  if (std::find(counts.begin(), counts.end(), count_) != counts.end()) return true;
  error("CL110",
        std::to_string(count_) + (count_ == 1 ? " value" : " values") + ", expected is " + form,
        items.empty() ? statement.place : items.back().place);
  return false;
}

bool Executor::numbers_from(std::span<const Item> items, const char* form) {
  count_ = 0;
  for (const Item& item : items) {
    if (item.kind != Item::Kind::number) {
      error("CL110",
            (item.kind == Item::Kind::empty ? std::string("a value is missing")
                                            : quoted(item.text) + " is not a number") +
                ", expected is " + form,
            item.place);
      return false;
    }
    if (count_ < kMostNumbers) numbers_[count_] = item.value;
    ++count_;
  }
  return true;
}

bool Executor::only_word(const Statement& statement, std::string_view& word, const char* form) {
  if (statement.items.size() == 1 && statement.items.front().kind == Item::Kind::word) {
    word = statement.items.front().text;
    return true;
  }
  error("CL110", std::string("expected is ") + form,
        statement.items.empty() ? statement.place : statement.items.front().place);
  return false;
}

bool Executor::length_unit(TextPlace place) {
  if (unit_) {
    if (!unit_given_ && once(unit_assumed))
      summary_.assumes.push_back("one unit of length is " + nc::decimal_text(*unit_, 4) +
                                 " mm: the user's word, the text does not say it");
    return true;
  }
  if (once(no_unit))
    error("CL111",
          "the unit of lengths is not known: no UNITS stands before; say --input-unit mm or inch",
          place);
  return false;
}

bool Executor::in_range(const Vec3& tip, TextPlace place) {
  if (tip.allFinite() && tip.cwiseAbs().maxCoeff() <= kLargest) return true;
  error("CL107", "a coordinate beyond 1000000 mm", place);
  return false;
}

void Executor::error(const char* code, std::string text, TextPlace place) {
  log_.error(code, std::move(text), place);
}

/// True the first time for a bit.
bool Executor::once(Once which) {
  const bool first = (told_ & which) == 0;
  told_ |= which;
  return first;
}

}  // namespace smoothpost::cl

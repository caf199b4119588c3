#include "formats/cl/words.h"

#include <algorithm>
#include <array>

namespace smoothpost::cl {
namespace {

constexpr std::string_view kFrame =
    "moves or turns the coordinates; let the CAM system write them in one frame";
constexpr std::string_view kSource =
    "belongs to the APT source language; let the CAM system write cutter locations (GOTO)";
constexpr std::string_view kFlow =
    "jumps or repeats; let the CAM system write the motions one after the other";
constexpr std::string_view kMachine =
    "moves the axes of one machine; write the tool axis as i,j,k of GOTO";
constexpr std::string_view kPlace =
    "moves to a place that only the machine knows; write it as GOTO, or leave it out: links are "
    "planned";

constexpr WordInfo refused(std::string_view name, std::string_view reason) {
  return {name, Word::refused, Rest::free, reason};
}

// Sorted by name.
constexpr std::array kWords = {
    refused("ARC", "is another way to write arcs; write CIRCLE and GOTO"),
    WordInfo{"AUTOPS", Word::no_effect, Rest::free, {}},
    refused("CALL", kFlow),
    refused("CALSUB", kFlow),
    WordInfo{"CIRCLE", Word::circle, Rest::items, {}},
    WordInfo{"CLPRNT", Word::no_effect, Rest::free, {}},
    refused("CONTRL", kFlow),
    WordInfo{"COOLNT", Word::coolnt, Rest::items, {}},
    refused("COPY", kFlow),
    WordInfo{"CSI_SET_EXTENSION_LENGTH", Word::description, Rest::free, {}},
    WordInfo{"CSI_SET_FLUTE_LENGTH", Word::description, Rest::free, {}},
    WordInfo{"CSYS", Word::csys, Rest::items, {}},
    WordInfo{"CUTCOM", Word::cutcom, Rest::items, {}},
    WordInfo{"CUTTER", Word::description, Rest::free, {}},
    WordInfo{"CYCLE", Word::cycle, Rest::items, {}},
    WordInfo{"DELAY", Word::delay, Rest::items, {}},
    WordInfo{"DISPLY", Word::no_effect, Rest::free, {}},
    refused("DNTCUT", "suppresses the motions that follow; let the CAM system leave them out"),
    WordInfo{"DWELL", Word::delay, Rest::items, {}},
    WordInfo{"END", Word::end, Rest::items, {}},
    WordInfo{"END-OF-PATH", Word::end_of_path, Rest::items, {}},
    WordInfo{"FEDRAT", Word::fedrat, Rest::items, {}},
    WordInfo{"FINI", Word::fini, Rest::items, {}},
    WordInfo{"FROM", Word::from, Rest::items, {}},
    refused("GO", kSource),
    refused("GOBACK", kSource),
    WordInfo{"GODLTA", Word::godlta, Rest::items, {}},
    refused("GODOWN", kSource),
    refused("GOFWD", kSource),
    refused("GOHOME", kPlace),
    refused("GOLFT", kSource),
    refused("GORGT", kSource),
    WordInfo{"GOTO", Word::go_to, Rest::items, {}},
    refused("GOUP", kSource),
    refused("HEAD", kMachine),
    refused("IF", kFlow),
    refused("INCLUD", kFlow),
    refused("INDEX", kFlow),
    refused("INDIRP", kSource),
    WordInfo{"INDIRV", Word::indirv, Rest::items, {}},
    WordInfo{"INSERT", Word::insert, Rest::line, {}},
    WordInfo{"INTOL", Word::no_effect, Rest::free, {}},
    WordInfo{"ISN", Word::no_effect, Rest::free, {}},
    refused("JUMPTO", kFlow),
    WordInfo{"LINTOL", Word::no_effect, Rest::free, {}},
    WordInfo{"LOAD", Word::load, Rest::items, {}},
    WordInfo{"LOADTL", Word::loadtl, Rest::items, {}},
    WordInfo{"MACHIN", Word::description, Rest::free, {}},
    refused("MACRO", kFlow),
    WordInfo{"MCHTOL", Word::no_effect, Rest::free, {}},
    refused("MOVARC", "is another way to write arcs; write CIRCLE and GOTO"),
    WordInfo{"MSYS", Word::msys, Rest::items, {}},
    WordInfo{"MULTAX", Word::multax, Rest::items, {}},
    refused("NURBS", "is a spline; let the CAM system write lines and arcs"),
    WordInfo{"OPSTOP", Word::opstop, Rest::items, {}},
    refused("ORIGIN", kFrame),
    WordInfo{"OUTTOL", Word::no_effect, Rest::free, {}},
    WordInfo{"PAINT", Word::no_effect, Rest::free, {}},
    WordInfo{"PARTNO", Word::description, Rest::line, {}},
    WordInfo{"PLABEL", Word::no_effect, Rest::free, {}},
    WordInfo{"PLOT", Word::no_effect, Rest::free, {}},
    refused("POLYNOMIAL", "is a spline; let the CAM system write lines and arcs"),
    WordInfo{"PPLOT", Word::no_effect, Rest::free, {}},
    WordInfo{"PPRINT", Word::text, Rest::line, {}},
    refused("PROBE", "is a measurement; no output dialect has it"),
    refused("PSIS", kSource),
    WordInfo{"RAPID", Word::rapid, Rest::items, {}},
    refused("READ", kFlow),
    refused("REDEF", kFlow),
    WordInfo{"REMARK", Word::text, Rest::line, {}},
    refused("RETRCT", kPlace),
    refused("ROTABL", kMachine),
    refused("ROTATE", kMachine),
    refused("ROTHED", kMachine),
    refused("SAFPOS", kPlace),
    WordInfo{"SELCTL", Word::no_effect, Rest::free, {}},
    WordInfo{"SELECT", Word::select, Rest::items, {}},
    WordInfo{"SEQNO", Word::no_effect, Rest::free, {}},
    WordInfo{"SETUP", Word::description, Rest::free, {}},
    WordInfo{"SPINDL", Word::spindl, Rest::items, {}},
    refused("SPLINE", "is a spline; let the CAM system write lines and arcs"),
    WordInfo{"STOP", Word::stop, Rest::items, {}},
    refused("THREAD", "needs a spindle with position feedback; no output dialect has it"),
    WordInfo{"TLAXIS", Word::tlaxis, Rest::items, {}},
    WordInfo{"TLDATA", Word::description, Rest::free, {}},
    refused("TLLFT", kSource),
    refused("TLOFPS", kSource),
    WordInfo{"TLON", Word::tlon, Rest::items, {}},
    refused("TLONPS", kSource),
    refused("TLRGT", kSource),
    WordInfo{"TOLER", Word::no_effect, Rest::free, {}},
    WordInfo{"TOOLNO", Word::toolno, Rest::free, {}},
    WordInfo{"TOOLPATH", Word::description, Rest::line, {}},
    WordInfo{"TPRINT", Word::description, Rest::free, {}},
    refused("TRACUT", kFrame),
    refused("TRANS", kFrame),
    WordInfo{"TRNTYP", Word::trntyp, Rest::items, {}},
    refused("TURRET", kMachine),
    WordInfo{"UNIT", Word::units, Rest::items, {}},
    WordInfo{"UNITS", Word::units, Rest::items, {}},
    WordInfo{"VERIFY", Word::no_effect, Rest::free, {}},
};

static_assert(std::is_sorted(kWords.begin(), kWords.end(),
                             [](const WordInfo& a, const WordInfo& b) { return a.name < b.name; }));

}  // namespace

const WordInfo* find_word(std::string_view upper) {
  const auto row = std::lower_bound(
      kWords.begin(), kWords.end(), upper,
      [](const WordInfo& info, std::string_view name) { return info.name < name; });
  return row != kWords.end() && row->name == upper ? &*row : nullptr;
}

bool same_word(std::string_view text, std::string_view upper_case) {
  return text.size() == upper_case.size() &&
         std::equal(text.begin(), text.end(), upper_case.begin(),
                    [](char a, char b) { return upper(a) == b; });
}

}  // namespace smoothpost::cl

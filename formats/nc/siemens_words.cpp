#include "formats/nc/siemens_words.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "formats/nc/number.h"

namespace smoothpost::nc {
namespace {

struct Keyword {
  std::string_view name;
  SiemensWord word;
};

constexpr Keyword kKeywords[] = {
    {"TRAORI", SiemensWord::traori},   {"TRAFOOF", SiemensWord::trafoof},
    {"ORIWKS", SiemensWord::oriwks},   {"ORIMKS", SiemensWord::orimks},
    {"ORIVECT", SiemensWord::orivect}, {"ORIPLANE", SiemensWord::orivect},
    {"ORIAXES", SiemensWord::oriaxes}, {"TRANS", SiemensWord::trans},
    {"ATRANS", SiemensWord::atrans},   {"ROT", SiemensWord::rot},
    {"AROT", SiemensWord::arot},       {"SUPA", SiemensWord::supa},
    {"RET", SiemensWord::program_end}, {"MCALL", SiemensWord::modal_call},
};

/// Speed, smoothing and buffering: nothing that changes where the programmed points are.
constexpr std::string_view kNoEffect[] = {
    "SOFT",     "SOFTA",   "BRISK",     "BRISKA",     "DRIVE",     "DRIVEA",  "FFWON",
    "FFWOF",    "COMPON",  "COMPCURV",  "COMPCAD",    "COMPSURF",  "COMPOF",  "FNORM",
    "FLIN",     "CFC",     "CFTCP",     "CFIN",       "UPATH",     "SPATH",   "STOPRE",
    "WALIMON",  "WALIMOF", "STARTFIFO", "STOPFIFO",   "FIFOCTRL",  "CDON",    "CDOF",
    "CDOF2",    "DYNNORM", "DYNROUGH",  "DYNSEMIFIN", "DYNFINISH", "DYNPOS",  "DYNPREC",
    "RTLION",   "RTLIOF",  "NORM",      "KONT",       "DIAMOF",    "ORISON",  "ORISOF",
    "ORIEULER", "ORIRPY",  "ORIRPY2",   "EXTOF",      "PAROTOF",   "TOROTOF", "TOFROF"};

constexpr std::string_view kTolerances[] = {"CTOL", "OTOL", "ATOL", "ADIS", "ADISPOS"};

constexpr std::string_view kFlow[] = {"FOR",     "ENDFOR", "LOOP",   "ENDLOOP", "REPEAT",
                                      "REPEATB", "UNTIL",  "CASE",   "CALL",    "PCALL",
                                      "EXTCALL", "PROC",   "EXTERN", "TO"};

constexpr std::string_view kSplines[] = {"BSPLINE", "ASPLINE", "CSPLINE", "POLY",      "PO",
                                         "PL",      "SD",      "PW",      "SPLINEPATH"};
constexpr std::string_view kFrames[] = {
    "SCALE",    "ASCALE",   "MIRROR",   "AMIRROR", "ROTS",   "AROTS",   "CROTS",  "TOFRAME",
    "TOFRAMEX", "TOFRAMEY", "TOFRAMEZ", "TOROT",   "TOROTZ", "PAROT",   "CTRANS", "CROT",
    "CFINE",    "G58",      "G59",      "TCARR",   "TCOFR",  "CYCLE800"};
constexpr std::string_view kTransformations[] = {"TRANSMIT", "TRACYL",      "TRAANG",    "TRACON",
                                                 "TRAFOON",  "TRAORI_STAT", "TRAORI_DYN"};
constexpr std::string_view kArcs[] = {"CT", "AR", "AP", "RP", "INVCW", "INVCCW"};

template <std::size_t N>
bool contains(const std::string_view (&list)[N], std::string_view name) {
  return std::find(std::begin(list), std::end(list), name) != std::end(list);
}

bool digits(std::string_view text) {
  return !text.empty() &&
         std::all_of(text.begin(), text.end(), [](char c) { return detail::is_digit(c); });
}

}  // namespace

std::string upper_text(std::string_view text) {
  std::string out(text);
  for (char& c : out) {
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 32);
  }
  return out;
}

SiemensWord siemens_keyword(std::string_view text) {
  const std::string name = upper_text(text);
  for (const Keyword& keyword : kKeywords) {
    if (keyword.name == name) return keyword.word;
  }
  return contains(kNoEffect, name) ? SiemensWord::no_effect : SiemensWord::none;
}

SiemensWord siemens_call(std::string_view text, std::string_view arguments) {
  const std::string name = upper_text(text);
  const bool empty = arguments.find_first_not_of(" \t") == std::string_view::npos;
  if (name == "MSG") return empty ? SiemensWord::no_effect : SiemensWord::message;
  if (name == "CYCLE832") return SiemensWord::cycle832;
  if (name == "CYCLE800") return empty ? SiemensWord::no_swivel : SiemensWord::none;
  if (name == "CYCLE81" || name == "CYCLE82") return SiemensWord::single_call;
  if (name == "TRAORI") return SiemensWord::traori;
  if (name == "TRAFOOF" && empty) return SiemensWord::trafoof;
  if (name == "SOFTA" || name == "BRISKA" || name == "DRIVEA") return SiemensWord::no_effect;
  return empty ? siemens_keyword(name) : SiemensWord::none;
}

char siemens_address(std::string_view text) {
  const std::string name = upper_text(text);
  static constexpr std::string_view kLetters = "XYZABCUVWIJKFSTDHM";
  if (name.size() == 1) return kLetters.find(name[0]) != std::string_view::npos ? name[0] : '\0';
  if (name == "A3") return kAxisVectorX;
  if (name == "B3") return kAxisVectorY;
  if (name == "C3") return kAxisVectorZ;
  if (name == "CR") return kCircleRadius;
  if (name == "TURN") return kCircleTurns;
  if (name == "RPL") return kPlaneAngle;
  if (name == "I1") return kThroughX;
  if (name == "J1") return kThroughY;
  if (name == "K1") return kThroughZ;
  return '\0';
}

bool is_siemens_tolerance(std::string_view name) { return contains(kTolerances, upper_text(name)); }

bool is_r_parameter(std::string_view name) {
  return name.size() > 1 && (name[0] == 'R' || name[0] == 'r') && digits(name.substr(1));
}

std::string siemens_refusal(std::string_view text) {
  const std::string name = upper_text(text);
  const auto says = [&](std::string_view what, std::string_view remedy) {
    return name + ": " + std::string(what) + "; " + std::string(remedy);
  };
  constexpr std::string_view kPlain = "let the CAM post write the moves out";
  if (contains(kFlow, name)) {
    return says("counted loops and calls of other programs are not read in this version", kPlain);
  }
  if (contains(kSplines, name)) {
    return says("splines and polynomials are not read in this version",
                "let the CAM post write straight moves and arcs (G1, G2, G3)");
  }
  if (contains(kFrames, name)) {
    return says("this frame or swivelled plane is not read in this version",
                "let the CAM post write TRANS, ATRANS, ROT and AROT, or TRAORI");
  }
  if (contains(kTransformations, name)) {
    return says("this transformation is not read", "post the program for TRAORI");
  }
  if (contains(kArcs, name)) {
    return says("this form of an arc is not read in this version",
                "let the CAM post write CIP, or G2 and G3 with I J K or CR=");
  }
  if (name.size() == 2 && name[0] >= 'A' && name[0] <= 'C' && detail::is_digit(name[1])) {
    return says("the tool axis is read as A3= B3= C3= or as rotary axes",
                "let the CAM post write the direction vector");
  }
  if (name == "LEAD" || name == "TILT" || name == "THETA" || name.starts_with("ORI")) {
    return says("this kind of orientation is not read in this version",
                "let the CAM post write A3= B3= C3= under ORIWKS and ORIVECT");
  }
  if (name.starts_with("CYCLE") || name.starts_with("POCKET") || name.starts_with("HOLES") ||
      name.starts_with("SLOT") || name == "LONGHOLE") {
    return says("of the cycles CYCLE81 and CYCLE82 are read", kPlain);
  }
  if (!name.empty() && name[0] == '$') {
    return says("system variables are not read", "let the CAM post write plain numbers");
  }
  return says("no word, variable or call that is read in this version",
              "remove it, or let the CAM post write without it");
}

std::string address_text(char address) {
  switch (address) {
    case kAxisVectorX:
      return "A3";
    case kAxisVectorY:
      return "B3";
    case kAxisVectorZ:
      return "C3";
    case kCircleRadius:
      return "CR";
    case kCircleTurns:
      return "TURN";
    case kPlaneAngle:
      return "RPL";
    case kThroughX:
      return "I1";
    case kThroughY:
      return "J1";
    case kThroughZ:
      return "K1";
    default:
      return std::string(1, address);
  }
}

}  // namespace smoothpost::nc

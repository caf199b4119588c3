#include "formats/nc/siemens_words.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "formats/nc/codes.h"
#include "formats/nc/number.h"

namespace smoothpost::nc {
namespace {

struct Keyword {
  std::string_view name;
  SiemensWord word;
};

constexpr Keyword kKeywords[] = {
    {"TRAORI", SiemensWord::traori},       {"TRAFOOF", SiemensWord::trafoof},
    {"ORIWKS", SiemensWord::oriwks},       {"ORIMKS", SiemensWord::orimks},
    {"ORIVECT", SiemensWord::orivect},     {"ORIPLANE", SiemensWord::orivect},
    {"ORIAXES", SiemensWord::oriaxes},     {"TRANS", SiemensWord::trans},
    {"ATRANS", SiemensWord::atrans},       {"ROT", SiemensWord::rot},
    {"AROT", SiemensWord::arot},           {"SUPA", SiemensWord::supa},
    {"RET", SiemensWord::program_end},     {"MCALL", SiemensWord::modal_call},
    {"ENDPROC", SiemensWord::program_end}, {"MIRROR", SiemensWord::mirror},
    {"AMIRROR", SiemensWord::amirror},     {"SCALE", SiemensWord::scale},
    {"ASCALE", SiemensWord::ascale},       {"ORIEULER", SiemensWord::orieuler},
    {"ORIRPY", SiemensWord::orirpy},       {"ORIRPY2", SiemensWord::oriother},
    {"ORIVIRT1", SiemensWord::oriother},   {"ORIVIRT2", SiemensWord::oriother},
};

/// Speed, smoothing and buffering: nothing that changes where the programmed points are.
constexpr std::string_view kNoEffect[] = {
    "SOFT",      "SOFTA",    "BRISK",   "BRISKA",   "DRIVE",   "DRIVEA",  "FFWON",    "FFWOF",
    "COMPON",    "COMPCURV", "COMPCAD", "COMPSURF", "COMPOF",  "FNORM",   "FLIN",     "CFC",
    "CFTCP",     "CFIN",     "UPATH",   "SPATH",    "STOPRE",  "WALIMON", "WALIMOF",  "STARTFIFO",
    "STOPFIFO",  "FIFOCTRL", "CDON",    "CDOF",     "CDOF2",   "DYNNORM", "DYNROUGH", "DYNSEMIFIN",
    "DYNFINISH", "DYNPOS",   "DYNPREC", "RTLION",   "RTLIOF",  "NORM",    "KONT",     "DIAMOF",
    "ORISON",    "ORISOF",   "EXTOF",   "PAROTOF",  "TOROTOF", "TOFROF"};

constexpr std::string_view kTolerances[] = {"CTOL", "OTOL", "ATOL", "ADIS", "ADISPOS"};

constexpr std::string_view kFlow[] = {"PCALL", "ISOCALL",  "TO",    "OF",    "DEFAULT",
                                      "GOTOS", "ENDLABEL", "SETAL", "WAITM", "INIT",
                                      "START", "STAT",     "CANCEL"};
constexpr std::string_view kSplines[] = {"BSPLINE",    "ASPLINE",  "CSPLINE", "SD",   "PW",
                                         "SPLINEPATH", "POLYPATH", "BAUTO",   "BNAT", "BTAN",
                                         "EAUTO",      "ENAT",     "ETAN"};
constexpr std::string_view kPolynomials[] = {"PO", "PL"};
constexpr std::string_view kFrames[] = {
    "ROTS",  "AROTS",  "CROTS", "TOFRAME", "TOFRAMEX", "TOFRAMEY", "TOFRAMEZ", "TOROT", "TOROTZ",
    "PAROT", "CTRANS", "CROT",  "CFINE",   "CSCALE",   "CMIRROR",  "TCARR",    "TCOFR"};
constexpr std::string_view kTransformations[] = {"TRANSMIT", "TRACYL",      "TRAANG",    "TRACON",
                                                 "TRAFOON",  "TRAORI_STAT", "TRAORI_DYN"};
constexpr std::string_view kArcs[] = {"INVCW", "INVCCW"};
constexpr std::string_view kCycles[] = {"CYCLE81", "CYCLE82",  "CYCLE83", "CYCLE84",
                                        "CYCLE85", "CYCLE86",  "CYCLE87", "CYCLE88",
                                        "CYCLE89", "CYCLE840", "HOLES1",  "HOLES2"};
/// Commands that a subprogram's name may not be taken for.
constexpr std::string_view kCommands[] = {
    "DEF",      "PROC",    "EXTERN",  "SAVE",    "DISPLOF", "SBLOF",   "SBLON",  "WHEN",
    "WHENEVER", "EVERY",   "DO",      "ID",      "IDS",     "LOCK",    "UNLOCK", "SPOS",
    "SPOSA",    "M17",     "G",       "FXS",     "MEAS",    "MEAC",    "LIMS",   "FGROUP",
    "FGREF",    "FL",      "POS",     "POSA",    "POSP",    "OFFN",    "CUT2D",  "CUT3DC",
    "CUT3DF",   "CUT3DFS", "CUT3DFF", "CUT3DCC", "TRAILON", "TRAILOF", "COUPON", "COUPOF",
    "LEADON",   "LEADOF",  "TANG",    "TANGON",  "TANGOF",  "REDEF",   "SETINT", "DISABLE",
    "ENABLE",   "SET",     "REP",     "RND",     "RNDM",    "CHF",     "CHR",    "ANG",
    "RETB",     "AND",     "OR",      "NOT",     "XOR",     "DIV",     "MOD",    "RPY",
    "DIAMON",   "DIAM90",  "DIAM90A", "G290",    "G291"};

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

int siemens_motion(std::string_view text) {
  const std::string name = upper_text(text);
  return name == "CIP" ? kPointArc : name == "CT" ? kTangentArc : name == "POLY" ? kPolynomial : 0;
}

bool is_siemens_cycle(std::string_view name) { return contains(kCycles, upper_text(name)); }

bool is_siemens_reserved(std::string_view text) {
  const std::string name = upper_text(text);
  return name.starts_with("CYCLE") || name.starts_with("POCKET") || name.starts_with("HOLES") ||
         name.starts_with("SLOT") || name.starts_with("LONGHOLE") || name.starts_with("ORI") ||
         name.starts_with("GROUP_") || name[0] == '$' || name == "LEAD" || name == "TILT" ||
         name == "THETA" || contains(kFlow, name) || contains(kSplines, name) ||
         contains(kPolynomials, name) || contains(kFrames, name) ||
         contains(kTransformations, name) || contains(kArcs, name) || contains(kCommands, name) ||
         contains(kTolerances, name) || siemens_keyword(name) != SiemensWord::none ||
         siemens_motion(name) != 0 || siemens_address(name) != '\0';
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
  if (name == "CYCLE800") return empty ? SiemensWord::no_swivel : SiemensWord::swivel;
  if (is_siemens_cycle(name)) return SiemensWord::single_call;
  if (name == "TRAORI") return SiemensWord::traori;
  if (name == "TRAFOOF" && empty) return SiemensWord::trafoof;
  // What a control shows of a program: its blank, the groups of its lines.
  if (name == "WORKPIECE" || name == "GROUP_BEGIN" || name == "GROUP_END") {
    return SiemensWord::no_effect;
  }
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
  if (name == "AR") return kArcAngle;
  if (name == "AP") return kPolarAngle;
  if (name == "RP") return kPolarRadius;
  if (name == "A2") return kAxisAngleA;
  if (name == "B2") return kAxisAngleB;
  if (name == "C2") return kAxisAngleC;
  if (name == "PL") return kParameterLength;
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
    return says("this jump, call or work with channels is not read in this version", kPlain);
  }
  if (contains(kSplines, name)) {
    return says("splines are not read: how the control places the knots is not stated anywhere",
                "let the CAM post write straight moves, arcs (G1, G2, G3) or POLY");
  }
  if (contains(kPolynomials, name)) {
    return says("polynomials are written PO[X]=(end,a2,a3,a4,a5) with PL=, for X, Y and Z",
                "mend the word, or let the CAM post write straight moves");
  }
  if (contains(kFrames, name)) {
    return says("this frame or swivelled plane is not read in this version",
                "let the CAM post write TRANS, ROT, MIRROR, SCALE and their A.. forms, or TRAORI");
  }
  if (contains(kTransformations, name)) {
    return says("this transformation is not read", "post the program for TRAORI");
  }
  if (contains(kArcs, name)) {
    return says("this form of an arc is not read in this version",
                "let the CAM post write CIP, or G2 and G3 with I J K or CR=");
  }
  if (name.size() == 2 && name[0] >= 'A' && name[0] <= 'C' && detail::is_digit(name[1])) {
    return says(
        "the tool axis is read as A3= B3= C3=, as A2= B2= C2= under ORIEULER or ORIRPY, or "
        "as rotary axes",
        "let the CAM post write the direction vector");
  }
  if (name == "LEAD" || name == "TILT" || name == "THETA" || name.starts_with("ORI")) {
    return says("this kind of orientation is not read in this version",
                "let the CAM post write A3= B3= C3= under ORIWKS and ORIVECT");
  }
  if (name.starts_with("CYCLE") || name.starts_with("POCKET") || name.starts_with("HOLES") ||
      name.starts_with("SLOT") || name == "LONGHOLE") {
    return says("of the cycles CYCLE81 to CYCLE89, CYCLE840, HOLES1 and HOLES2 are read", kPlain);
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
    case kArcAngle:
      return "AR";
    case kPolarAngle:
      return "AP";
    case kPolarRadius:
      return "RP";
    case kAxisAngleA:
      return "A2";
    case kAxisAngleB:
      return "B2";
    case kAxisAngleC:
      return "C2";
    case kParameterLength:
      return "PL";
    default:
      return std::string(1, address);
  }
}

}  // namespace smoothpost::nc

#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "formats/nc/program.h"

namespace smoothpost::nc {

/// What a statement of a Sinumerik 840D program does here; the `detail` of a statement piece.
enum class SiemensWord : std::uint8_t {
  none,              ///< not read
  no_effect,         ///< path and dynamics words, tolerances, labels, program names
  traori,            ///< tool-centre-point mode on
  trafoof,           ///< any transformation off
  oriwks,            ///< tool axis vectors in the workpiece
  orimks,            ///< tool axis vectors in the machine
  orivect,           ///< the tool axis turns on a great circle
  oriaxes,           ///< the rotary axes go linearly
  trans,             ///< frame: shift
  atrans,            ///< frame: further shift
  rot,               ///< frame: rotation
  arot,              ///< frame: further rotation
  supa,              ///< this block in machine coordinates
  message,           ///< MSG("text")
  cycle832,          ///< tolerance cycle
  no_swivel,         ///< CYCLE800(): end of the swivelled plane
  declaration,       ///< DEF REAL name, ...
  program_end,       ///< RET
  modal_call,        ///< MCALL CYCLE81(..), MCALL
  single_call,       ///< CYCLE81(..), HOLES1(..) ...
  mirror,            ///< frame: mirror image
  amirror,           ///< frame: further mirror image
  scale,             ///< frame: scale
  ascale,            ///< frame: further scale
  orieuler,          ///< A2= B2= C2= are Euler angles
  orirpy,            ///< A2= B2= C2= are roll, pitch and yaw
  oriother,          ///< A2= B2= C2= have another meaning
  polynomial,        ///< PO[X]=(..)
  offset_data,       ///< $P_UIFR[1,X,TR]=..
  swivel,            ///< CYCLE800(..): swivelled plane
  program_name,      ///< %_N_NAME_SPF
  procedure,         ///< PROC NAME(..), of the program that it stands in
  further_procedure  ///< PROC NAME(..) behind an end: of a further program
};

/// A drilling cycle or a pattern of holes: CYCLE81 to CYCLE89, CYCLE840, HOLES1, HOLES2. Any case.
bool is_siemens_cycle(std::string_view name);

/// Whether a name is one of the control's own, so that no subprogram has it. Any case.
bool is_siemens_reserved(std::string_view name);

/// The pseudo code of CIP, CT and POLY; 0: none of them. Any case.
int siemens_motion(std::string_view name);

/// The meaning of a word that stands alone: TRAORI, SOFT, G642 is none of them. Any case.
SiemensWord siemens_keyword(std::string_view name);

/// The meaning of NAME(...) with the given text between its parentheses.
SiemensWord siemens_call(std::string_view name, std::string_view arguments);

/// The address of NAME=...: a letter, one of the addresses of program.h, or 0.
char siemens_address(std::string_view name);

/// NAME=... that sets a tolerance of the path and nothing here.
bool is_siemens_tolerance(std::string_view name);

/// R1, R25: an arithmetic parameter.
bool is_r_parameter(std::string_view name);

/// Why a word, call or address is not read, and what to do.
std::string siemens_refusal(std::string_view name);

/// "A3", "CR", "X": the text of an address.
std::string address_text(char address);

/// `text` in upper case.
std::string upper_text(std::string_view text);

}  // namespace smoothpost::nc

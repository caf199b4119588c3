#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/core/pose.h"
#include "kernels/core/result.h"

namespace smoothpost {

/// The largest coordinate that a reader of parts accepts, mm: beyond it the single precision of STL
/// steps by more than 0.06 mm.
inline constexpr double kLargestStlCoordinate = 1.0e6;

struct StlSettings {
  /// Factor from the file's numbers to mm: 1 for a file in mm, 25.4 for one in inches. STL states
  /// no unit.
  double scale = 1.0;
};

/// The triangles of an STL file as they stand there: nothing welded, nothing left out.
struct StlMesh {
  std::vector<Vec3> corners;  ///< three per triangle, mm, in file order
  bool binary = true;
  std::vector<std::string> solids;  ///< names of the solids of a text file, in order ("" unnamed)
  /// Triangles whose stored normal points against the winding of their corners. The winding counts.
  std::size_t normals_against_winding = 0;

  std::size_t triangles() const { return corners.size() / 3; }
};

/// Reads a binary or text STL file from memory through assimp.
///
/// Before assimp sees a byte the file is judged here: binary or text (by the size that the triangle
/// count implies, then by the content, never by the word "solid" alone); the triangle count against
/// the size; every text line against the grammar; every coordinate against kLargestStlCoordinate.
/// Memory is taken for what the file holds, not for what its header says. After assimp the triangle
/// counts must agree.
///
/// Guarantees: any bytes end in a value or in diagnostics; keywords of text files in any case;
///   trailing bytes shorter than one triangle are left out with a warning, longer ones are refused.
/// Units: mm = number in the file · settings.scale. Coordinates carry the single precision of STL.
/// Cost: linear; 1,000,000 binary triangles about 0.2 s, 120 bytes each at the peak.
/// @param bytes  the file   @param file_name  for messages only
/// @pre settings.scale > 0 and finite   @throws ContractViolation if not.
/// @return errors STL101..STL112, warnings STL104, STL113 (docs/formats_stl.md)
Result<StlMesh> read_stl(std::string_view bytes, const std::string& file_name,
                         const StlSettings& settings = {});

}  // namespace smoothpost

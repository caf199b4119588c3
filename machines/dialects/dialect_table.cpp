#include "machines/dialects/dialect_table.h"

#include <array>

#include "machines/dialects/beckhoff.h"
#include "machines/dialects/fanuc_30i.h"
#include "machines/dialects/fanuc_ls.h"
#include "machines/dialects/grbl.h"
#include "machines/dialects/heidenhain.h"
#include "machines/dialects/krl.h"
#include "machines/dialects/linuxcnc.h"
#include "machines/dialects/rapid.h"
#include "machines/dialects/ros_trajectory.h"
#include "machines/dialects/siemens_840d.h"
#include "machines/dialects/urscript.h"
#include "machines/dialects/val3.h"
#include "machines/dialects/yaskawa_jbi.h"

namespace smoothpost {

std::span<const Dialect> dialects() {
  static const std::array<Dialect, 21> rows = {
      beckhoff::kDialect,           fanuc_30i::kDialect,
      fanuc_30i::kVectorDialect,    fanuc_ls::kDialect,
      grbl::kDialects[0],           grbl::kDialects[1],
      grbl::kDialects[2],           grbl::kDialects[3],
      grbl::kDialects[4],           heidenhain::kDialect,
      heidenhain::kVectorDialect,   krl::kDialect,
      linuxcnc::kDialect,           rapid::kDialect,
      ros_trajectory::kRos1Dialect, ros_trajectory::kDialect,
      siemens_840d::kDialect,       urscript::kDialect,
      urscript::kServoDialect,      val3::kDialect,
      yaskawa_jbi::kDialect};
  return rows;
}

const Dialect* find_dialect(std::string_view name) {
  for (const auto& row : dialects())
    if (row.name == name) return &row;
  return nullptr;
}

}  // namespace smoothpost

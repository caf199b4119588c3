#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kernels/core/process.h"
#include "kernels/core/result.h"

namespace smoothpost::nc {

using EventParameters = std::vector<std::pair<std::string, std::string>>;

/// The words of an event with its values filled in: "M3 S{rpm}" with {"rpm","630"} is "M3 S630".
/// A failure names the value that the event does not carry [PR...].
Result<std::string> render_event(const EventWords& words, const EventParameters& parameters);

}  // namespace smoothpost::nc

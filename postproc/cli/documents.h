#pragma once

#include <string>

namespace CLI {
class App;
}

namespace smoothpost::cli {

/// What is told of the command line elsewhere, made from its table of options, so that it says
/// what --help says. `kind`: man (a manual page, troff), bash, zsh, fish (a completion).
/// @pre kind is one of these
std::string document(const CLI::App& app, const std::string& kind);

}  // namespace smoothpost::cli

#include "postproc/cli/documents.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <vector>

#include "smoothpost/smoothpost.h"

namespace smoothpost::cli {

namespace {

using Options = std::vector<const CLI::Option*>;

std::vector<const CLI::App*> commands(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* c) { return !c->get_name().empty(); });
}

Options named_options(const CLI::App& app) {
  return app.get_options([](const CLI::Option* o) { return o->nonpositional(); });
}

Options positionals(const CLI::App& app) {
  return app.get_options([](const CLI::Option* o) { return o->get_positional(); });
}

bool takes_value(const CLI::Option* option) { return option->get_items_expected_max() > 0; }

/// "-m", "--machine"
std::vector<std::string> names_of(const CLI::Option* option) {
  std::vector<std::string> names;
  for (const auto& name : option->get_snames()) names.push_back("-" + name);
  for (const auto& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

std::string joined(const std::vector<std::string>& words, const char* between) {
  std::string text;
  for (const auto& word : words) text += (text.empty() ? "" : between) + word;
  return text;
}

/// The values that a description lists: "acr | ramp | none", "jerk (default) | constant". A list
/// with anything else in it is none.
std::vector<std::string> choices(const std::string& description) {
  std::vector<std::string> found;
  std::string rest = description.substr(0, description.find_first_of(";:"));
  if (const auto after = description.find(": ");
      rest.find(" | ") == std::string::npos && after != std::string::npos)
    rest = description.substr(after + 2, description.find(';', after) - after - 2);
  if (rest.find(" | ") == std::string::npos) return {};
  while (true) {
    const auto end = rest.find(" | ");
    std::string word = rest.substr(0, end);
    word = word.substr(0, word.find_first_of(" ,("));
    if (word.empty() ||
        word.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_.-") != std::string::npos)
      return {};
    found.push_back(word);
    if (end == std::string::npos) return found;
    rest.erase(0, end + 3);
  }
}

bool names_machine(const CLI::Option* option) {
  const auto& names = option->get_lnames();
  return std::any_of(names.begin(), names.end(),
                     [](const std::string& n) { return n == "machine" || n == "input-machine"; });
}

/// What a shell runs to learn the names of machines.
constexpr const char* kMachineNames =
    "smoothpost machines list 2>/dev/null | sed -n 's/^\\([^ :]*\\):.*/\\1/p'";

// --- manual page
// -------------------------------------------------------------------------------------

/// `text` as troff prints it: no control line, hyphens that can be copied.
std::string troff(const std::string& text) {
  std::string out;
  bool at_start = true;
  for (const char c : text) {
    if (at_start && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
    at_start = c == '\n';
  }
  return out;
}

std::string example_section(const std::string& example) {
  std::string text;
  bool code = false;
  std::size_t at = 0;
  while (at < example.size()) {
    const std::size_t end = std::min(example.find('\n', at), example.size());
    std::string line = example.substr(at, end - at);
    at = end + 1;
    const bool is_code = line.rfind("  ", 0) == 0;
    if (is_code != code) text += is_code ? ".PP\n.RS 4\n.nf\n" : ".fi\n.RE\n.PP\n";
    code = is_code;
    text += troff(is_code ? line.substr(2) : line) + "\n";
  }
  return text + (code ? ".fi\n.RE\n" : "");
}

std::string option_items(const CLI::App& app) {
  std::string text;
  for (const CLI::Option* o : positionals(app))
    text += ".TP\n.I " + troff(o->get_name(true)) + "\n" + troff(o->get_description()) + "\n";
  for (const CLI::Option* o : named_options(app)) {
    std::vector<std::string> names;
    for (const auto& name : names_of(o)) names.push_back("\\fB" + troff(name) + "\\fR");
    text += ".TP\n" + joined(names, ", ") + (takes_value(o) ? " \\fIVALUE\\fR" : "") + "\n" +
            troff(o->get_description()) + "\n";
  }
  return text;
}

std::string synopsis(const CLI::App& command) {
  std::string text = ".B smoothpost " + troff(command.get_name()) + "\n";
  for (const CLI::Option* o : positionals(command)) text += ".I " + troff(o->get_name(true)) + "\n";
  return text + ".RI [ options ]\n";
}

std::string man_page(const CLI::App& app) {
  std::string text = std::string(".TH SMOOTHPOST 1 \"\" \"smoothpost ") + smoothpost_version() +
                     "\" \"User Commands\"\n.SH NAME\nsmoothpost \\- CAM programs to certified "
                     "machine programs\n.SH SYNOPSIS\n";
  bool first = true;
  for (const CLI::App* c : commands(app)) {
    text += (first ? "" : ".br\n") + synopsis(*c);
    first = false;
  }
  text += ".SH EXAMPLES\n" + example_section(app.get_footer());
  text +=
      ".SH DESCRIPTION\nReads a program of a CAM system, moves it to the machine that a machine "
      "file describes, writes a program\nfor its control, reads that back and states how far it "
      "is from the input and what was not checked. What cannot\nbe certified is not written.\n";
  text += ".SH OPTIONS\n" + option_items(app);
  for (const CLI::App* c : commands(app)) {
    text += ".SH COMMAND " + troff(c->get_name()) + "\n" + troff(c->get_description()) + ".\n";
    if (c->get_footer() != app.get_footer()) text += ".PP\n" + example_section(c->get_footer());
    text += option_items(*c);
  }
  text +=
      ".SH EXIT STATUS\n.TP\n.B 0\ncertified and written\n.TP\n.B 1\ninternal error\n.TP\n.B 2\n"
      "usage, or cancelled\n.TP\n.B 3\nrefused: a limit, tolerance, clearance or process rule "
      "cannot be met\n.TP\n.B 4\nthe input cannot be read or understood\n"
      ".SH ENVIRONMENT\n.TP\n.B SMOOTHPOST_MACHINES\nfolders of machines, separated by ':'\n"
      ".SH NOTES\nCtrl\\-C stops where a file is whole or not there; a second one ends at once.\n";
  return text;
}

// --- completions
// -------------------------------------------------------------------------------------

/// `text` inside single quotes of a shell.
std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

std::string all_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* o : named_options(app))
    for (const auto& name : names_of(o)) names.push_back(name);
  return joined(names, " ");
}

std::string command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* c : commands(app)) names.push_back(c->get_name());
  return joined(names, " ");
}

/// Words after `machines` and `golden`.
std::vector<std::string> first_words(const CLI::App& command) {
  return command.get_name() == "machines" || command.get_name() == "golden"
             ? choices(command.get_name() == "machines" ? "list | show | validate | test-program"
                                                        : "run | update")
             : std::vector<std::string>{};
}

std::string bash(const CLI::App& app) {
  std::string text =
      "# bash completion of smoothpost; made by `smoothpost --generate bash`\n_smoothpost() {\n"
      "  local now=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} command= word\n"
      "  for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n"
      "    case $word in -*) ;; *) command=$word; break ;; esac\n  done\n  COMPREPLY=()\n"
      "  case $command:$before in\n";
  for (const CLI::App* c : commands(app))
    for (const CLI::Option* o : named_options(*c)) {
      if (!takes_value(o)) continue;
      const auto values = choices(o->get_description());
      if (values.empty() && !names_machine(o)) continue;
      std::vector<std::string> patterns;
      for (const auto& name : names_of(o)) patterns.push_back(c->get_name() + ":" + name);
      text += "    " + joined(patterns, "|") + ") COMPREPLY=($(compgen -W \"" +
              (values.empty() ? "$(" + std::string(kMachineNames) + ")" : joined(values, " ")) +
              "\" -- \"$now\"))";
      // A machine may be a file, too.
      text += names_machine(o) ? "; COMPREPLY+=($(compgen -f -- \"$now\")); return ;;\n"
                               : "; return ;;\n";
    }
  text += "  esac\n  case $command in\n    '') COMPREPLY=($(compgen -W \"" + command_names(app) +
          " " + all_names(app) + "\" -- \"$now\")); return ;;\n";
  for (const CLI::App* c : commands(app)) {
    const std::string words = joined(first_words(*c), " ");
    text += "    " + c->get_name() + ") case $now in -*) COMPREPLY=($(compgen -W \"" +
            all_names(*c) + "\" -- \"$now\")); return ;; esac";
    if (!words.empty()) text += "; COMPREPLY=($(compgen -W \"" + words + "\" -- \"$now\"))";
    text += " ;;\n";
  }
  return text +
         "  esac\n  COMPREPLY+=($(compgen -f -- \"$now\"))\n}\n"
         "complete -o filenames -F _smoothpost smoothpost\n";
}

/// `text` inside the brackets of a zsh specification.
std::string zsh_words(std::string text) {
  std::string out;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

std::string zsh_option(const CLI::Option* o) {
  std::string action;
  if (takes_value(o)) {
    const auto values = choices(o->get_description());
    action = ":value:";
    if (names_machine(o))
      action += "_smoothpost_machines";
    else
      action += values.empty() ? std::string("_files") : "(" + joined(values, " ") + ")";
  }
  std::string text;
  for (const auto& name : names_of(o))
    text +=
        " \\\n        " + quoted("*" + name + "[" + zsh_words(o->get_description()) + "]" + action);
  return text;
}

std::string zsh(const CLI::App& app) {
  std::string text =
      "#compdef smoothpost\n# zsh completion of smoothpost; made by `smoothpost --generate zsh`\n"
      "_smoothpost_machines() {\n  local -a names\n  names=(${(f)\"$(" +
      std::string(kMachineNames) +
      ")\"})\n  compadd -a names\n  _files\n}\n"
      "_smoothpost() {\n  local context state line\n  local -a commands\n  commands=(\n";
  for (const CLI::App* c : commands(app))
    text += "    " + quoted(c->get_name() + ":" + c->get_description()) + "\n";
  text += "  )\n  _arguments -C";
  for (const CLI::Option* o : named_options(app)) text += zsh_option(o);
  text +=
      " \\\n        '1:command:->command' '*::words:->words'\n  case $state in\n"
      "    command) _describe command commands ;;\n    words) case $line[1] in\n";
  for (const CLI::App* c : commands(app)) {
    const std::string words = joined(first_words(*c), " ");
    text += "      " + c->get_name() + ") _arguments -S";
    for (const CLI::Option* o : named_options(*c)) text += zsh_option(o);
    text += std::string(" \\\n        ") +
            (words.empty() ? "'*:file:_files'" : "'1:word:(" + words + ")' '*:file:_files'") +
            " ;;\n";
  }
  return text + "    esac ;;\n  esac\n}\n_smoothpost \"$@\"\n";
}

std::string fish_option(const CLI::Option* o, const std::string& condition) {
  std::string text = "complete -c smoothpost -n " + quoted(condition);
  for (const auto& name : o->get_snames()) text += " -s " + name;
  for (const auto& name : o->get_lnames()) text += " -l " + name;
  if (takes_value(o)) {
    const auto values = choices(o->get_description());
    text += " -r";
    if (names_machine(o))
      text += " -F -a " + quoted("(" + std::string(kMachineNames) + ")");
    else
      text += values.empty() ? std::string(" -F") : " -f -a " + quoted(joined(values, " "));
  }
  return text + " -d " + quoted(o->get_description()) + "\n";
}

std::string fish(const CLI::App& app) {
  std::string text = "# fish completion of smoothpost; made by `smoothpost --generate fish`\n";
  for (const CLI::Option* o : named_options(app)) text += fish_option(o, "__fish_use_subcommand");
  for (const CLI::App* c : commands(app)) {
    const std::string inside = "__fish_seen_subcommand_from " + c->get_name();
    text += "complete -c smoothpost -n __fish_use_subcommand -f -a " + quoted(c->get_name()) +
            " -d " + quoted(c->get_description()) + "\n";
    for (const auto& word : first_words(*c))
      text += "complete -c smoothpost -n " + quoted(inside) + " -a " + word + "\n";
    for (const CLI::Option* o : named_options(*c)) text += fish_option(o, inside);
  }
  return text;
}

}  // namespace

std::string document(const CLI::App& app, const std::string& kind) {
  if (kind == "bash") return bash(app);
  if (kind == "zsh") return zsh(app);
  if (kind == "fish") return fish(app);
  return man_page(app);
}

}  // namespace smoothpost::cli

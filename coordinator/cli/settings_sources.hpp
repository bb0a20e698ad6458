// Where options come from beside the command line: the environment, and a TOML file.
#pragma once

namespace CLI {
class App;
}

namespace pvsfarm {

// Gives every long option of `app` and its subcommands an environment variable, and `app` the
// option
// --config. Flag > environment > file > default. A file may hold tables for several commands; a key
// that no command knows is an error.
// Requires: all commands have been added.
void add_settings_sources(CLI::App& app);

}  // namespace pvsfarm

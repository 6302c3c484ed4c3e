#pragma once

namespace CLI {
class App;
}

namespace palpate::cli {

/// Groups the flags in the help of every command by what they are for. To be called once all
/// commands are there.
void arrange_help(CLI::App& app);

}  // namespace palpate::cli

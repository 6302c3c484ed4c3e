#pragma once

namespace CLI {
class App;
}

namespace palpate::cli {

/// The program `palpate`. Returns its exit status.
int run_program(int argc, char** argv);

// Each function adds one command with its flags to the program; the command runs once it is parsed.
void add_devices(CLI::App& app);
void add_sensors(CLI::App& app);
void add_record(CLI::App& app);
void add_touches(CLI::App& app);
void add_live(CLI::App& app);
void add_simulate(CLI::App& app);
void add_map(CLI::App& app);
void add_check(CLI::App& app);
void add_calibrate(CLI::App& app);
void add_recognize(CLI::App& app);
/// Its run throws CLI::RuntimeError, with the exit status, where it succeeds but some unknowns
/// fail.
void add_batch(CLI::App& app);
void add_merge(CLI::App& app);
void add_plan(CLI::App& app);
void add_evaluate(CLI::App& app);
void add_export(CLI::App& app);
void add_import(CLI::App& app);
void add_info(CLI::App& app);
void add_view(CLI::App& app);

}  // namespace palpate::cli

#include "cli/commands.hpp"

int main(int argc, char** argv) { return palpate::cli::run_program(argc, argv); }

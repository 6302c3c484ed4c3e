#include <chrono>
#include <cstring>
#include <iostream>
#include <palpate/driver.hpp>
#include <palpate/error.hpp>

int main() {
  using namespace palpate;
  for (const BoardInfo& board : list_boards()) {
    std::cout << board.name << " " << board.elements << " elements " << board.reason << "\n";
  }
  try {
    const auto sensor = open_board("tsf85:no such serial number");
    sensor->start();
    return sensor->next(std::chrono::seconds(1)) ? 0 : 1;
  } catch (const Error& error) {  // the profile is installed, but no such board is plugged in
    std::cout << error.what() << "\n";
    return std::strstr(error.what(), "not plugged in") != nullptr ? 0 : 1;
  }
}

#pragma once

#include <locale>
#include <string>

namespace palpate {

/// Numbers as "1.500,25", as in much of Europe.
class DecimalComma : public std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

/// C++'s global locale has decimal commas while this lives, as a host program may set it.
class HostLocale {
 public:
  HostLocale()
      : before_(std::locale::global(std::locale(std::locale::classic(), new DecimalComma))) {}
  ~HostLocale() { std::locale::global(before_); }
  HostLocale(const HostLocale&) = delete;
  HostLocale& operator=(const HostLocale&) = delete;

 private:
  std::locale before_;
};

}  // namespace palpate

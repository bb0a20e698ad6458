#include "worker/visibility/closed_sheet.hpp"

namespace pvsfarm {

void ClosedSheet::begin() {
  edges_.clear();
  basis_.clear();
  row_of_.fill(-1);
}

// Rows in echelon form: the first bit of each is the first bit of no other.
void ClosedSheet::eliminate() {
  for (Bits& row : edges_) {
    for (int at = row.first(); at >= 0; at = row.first()) {
      std::int16_t& pivot = row_of_[static_cast<std::size_t>(at)];
      if (pivot < 0) {
        pivot = static_cast<std::int16_t>(basis_.size());
        basis_.push_back(row);
        break;
      }
      row ^= basis_[static_cast<std::size_t>(pivot)];
    }
  }
}

// The row plus rows of the basis, so that no bit is left that is the first of one of them.
ClosedSheet::Bits ClosedSheet::reduced(Bits row) const {
  for (int i = 0; i < static_cast<int>(kMostColumns); ++i) {
    const std::int16_t pivot = row_of_[static_cast<std::size_t>(i)];
    if (pivot >= 0 && row.test(i)) row ^= basis_[static_cast<std::size_t>(pivot)];
  }
  return row;
}

// Of the columns that are no row's first bit this one alone; each of the others as its row asks.
ClosedSheet::Bits ClosedSheet::choice_with(int column) const {
  Bits choice;
  choice.flip(column);
  for (int i = static_cast<int>(kMostColumns) - 1; i >= 0; --i) {
    const std::int16_t pivot = row_of_[static_cast<std::size_t>(i)];
    if (pivot >= 0 && basis_[static_cast<std::size_t>(pivot)].odd_with(choice)) choice.flip(i);
  }
  return choice;
}

}  // namespace pvsfarm

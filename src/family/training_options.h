#pragma once
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "core/option.h"
#include "train/settings.h"

namespace warpath {

/// The options of training, one row each; users are families. What one row sets, rows below it may set further.
std::vector<Option> training_option_table(TrainSettings& settings);

/// Options of training as people give them, by name.
class TrainingOptions {
 public:
  /// How messages spell an option: `--max-steps`, or `max_steps` as in Python.
  enum class Spelling { command_line, python };
  explicit TrainingOptions(Spelling spelling = Spelling::python) : m_spelling(spelling) {}

  /// Throws ConfigError for an option that there is not, and for a value that it cannot have.
  void set(const std::string& name, const std::string& text);
  /// Throws ConfigError for an option that none of these families uses. trained: they are trained by themselves, not
  /// for an image, or while it is rendered.
  void check_used(const std::vector<std::string>& families, bool trained = false) const;
  TrainSettings settings(std::uint64_t seed) const;

 private:
  std::string spelled(const std::string& name) const;

  Spelling m_spelling;
  std::vector<std::pair<std::string, std::string>> m_given;
};

/// The names of the families that use an option.
std::vector<std::string> users_of(const Option& option, bool trained = false);

}  // namespace warpath

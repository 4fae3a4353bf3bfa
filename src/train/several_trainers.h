#pragma once
#include <vector>

#include "train/vertex_trainer.h"

namespace warpath {

/// Shows passes to several trainers, which must outlive it.
class SeveralTrainers final : public VertexLearner {
 public:
  explicit SeveralTrainers(std::vector<VertexTrainer*> trainers) : m_trainers(std::move(trainers)) {}

  std::unique_ptr<VertexRecorder> make_recorder() const override {
    auto recorder = std::make_unique<Recorder>();
    for (const VertexTrainer* trainer : m_trainers) recorder->of_each.push_back(trainer->make_recorder());
    return recorder;
  }
  void merge(VertexRecorder& recorder) override {
    auto& of_each = static_cast<Recorder&>(recorder).of_each;
    for (std::size_t t = 0; t < m_trainers.size(); ++t) m_trainers[t]->merge(*of_each[t]);
  }

 private:
  struct Recorder final : VertexRecorder {
    void record(const VertexRecords& records) override {
      for (const auto& recorder : of_each) recorder->record(records);
    }
    std::vector<std::unique_ptr<VertexRecorder>> of_each;
  };
  std::vector<VertexTrainer*> m_trainers;
};

}  // namespace warpath

// SPDX-License-Identifier: MIT
// How few descriptors are shared: never more than there are, nobody left out, the sessions last to go short.
#include "daemon/net/descriptor_budget.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace pmcd::net {
namespace {

TEST(DescriptorBudget, NeverMoreThanThereAre) {
  for (const std::size_t sessions : {1U, 2U, 16U, 9'000U}) {
    Limits wanted;
    wanted.sessions = sessions;
    std::size_t before = 0;
    for (std::size_t descriptors = kFewestDescriptors; descriptors <= 20'000; ++descriptors) {
      const Limits fit = fit_descriptors(wanted, descriptors);
      ASSERT_LE(descriptors_used(fit), descriptors);
      ASSERT_GE(fit.sessions, std::max<std::size_t>(before, 1)) << descriptors << ": more must not be less";
      ASSERT_LE(fit.sessions, wanted.sessions);
      ASSERT_GE(fit.admin_connections, 1U) << descriptors;
      ASSERT_LE(fit.admin_connections, wanted.admin_connections);
      ASSERT_GE(fit.turned_away, 1U) << descriptors;
      ASSERT_LE(fit.turned_away, wanted.turned_away);
      ASSERT_GE(fit.spare_data_connections, 1U) << descriptors;
      ASSERT_LE(fit.spare_data_connections, wanted.spare_data_connections);
      before = fit.sessions;
    }
  }
}

TEST(DescriptorBudget, AsWantedWhereThereAreEnough) {
  const Limits wanted;
  EXPECT_EQ(descriptors_used(wanted), 18'384U);
  EXPECT_EQ(fit_descriptors(wanted, 18'384).sessions, 9'000U);
  EXPECT_EQ(fit_descriptors(wanted, 18'384).admin_connections, wanted.admin_connections);
  EXPECT_EQ(fit_descriptors(wanted, 18'383).sessions, 8'999U);
  EXPECT_EQ(fit_descriptors(wanted, 18'383).admin_connections, wanted.admin_connections);
}

TEST(DescriptorBudget, TheSessionsKeepHalf) {
  const Limits fit = fit_descriptors(Limits{}, 132);
  EXPECT_EQ(fit.sessions, 25U);
  EXPECT_EQ(fit.admin_connections, 18U);
  EXPECT_EQ(fit.turned_away, 9U);
  EXPECT_EQ(fit.spare_data_connections, 4U);
}

}  // namespace
}  // namespace pmcd::net

# SPDX-License-Identifier: Apache-2.0
# Run when a GoogleTest program has been linked: writes a file that tells ctest of each of its suites, as one test. With
# a test for each case, the program would start for each, and make again what the cases of a suite share.
#   cmake -DPROGRAM=... -DFILE=... -DLABEL=... -DHERE=... -P discover_suites.cmake
execute_process(COMMAND ${PROGRAM} --gtest_list_tests OUTPUT_VARIABLE listed COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "\n[^ \n]+\\.[ \n]" heads "\n${listed}")
set(text "")
foreach(head ${heads})
  string(REGEX REPLACE "^\n(.*)\\.[ \n]$" "\\1" suite "${head}")
  # Skipped is a suite of which no case passed and none failed: the list of failed ones would come last.
  string(APPEND text "add_test([==[${suite}]==] [==[${PROGRAM}]==] [==[--gtest_filter=${suite}.*]==])\n"
    "set_tests_properties([==[${suite}]==] PROPERTIES TIMEOUT 1200 LABELS ${LABEL}\n"
    "  WORKING_DIRECTORY [==[${HERE}]==]
  SKIP_REGULAR_EXPRESSION [==[PASSED  . 0 tests.\n(.  SKIPPED [^\n]*\n)+\n*$]==])\n")
endforeach()
file(WRITE ${FILE} "${text}")

# marrow_compile_together(TARGET COUNT): compiles COUNT source files of a target at once, if MARROW_UNITY is on.
# Names in unnamed namespaces of such files must differ.
function(marrow_compile_together target count)
  if(MARROW_UNITY)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${count})
  endif()
endfunction()

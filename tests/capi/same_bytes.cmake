# The tool and a C caller make the same bytes from the same input.
file(MAKE_DIRECTORY ${WORK})
execute_process(
  COMMAND ${TOOL} convert ${SOURCE}/examples/mill_ac/mill_ac.ngc --input-machine table_table_ac
          -m table_table_bc --tool 1=60 -o ${WORK}/tool.ngc --json ${WORK}/tool.json
  RESULT_VARIABLE status)
if(NOT status EQUAL 0)
  message(FATAL_ERROR "the tool ended with ${status}")
endif()
execute_process(COMMAND ${CALLER} convert ${SOURCE} ${WORK}/caller.ngc ${WORK}/caller.json
                RESULT_VARIABLE status)
if(NOT status EQUAL 0)
  message(FATAL_ERROR "the caller ended with ${status}")
endif()
foreach(kind ngc json)
  file(READ ${WORK}/tool.${kind} tool HEX)
  file(READ ${WORK}/caller.${kind} caller HEX)
  if(NOT tool STREQUAL caller)
    message(FATAL_ERROR "tool.${kind} and caller.${kind} differ")
  endif()
endforeach()

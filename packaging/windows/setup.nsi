; AMR Scheduler for Windows 10 and 11, 64-bit, for all users of a machine. Made by make_setup.py, which defines VERSION, STAGE and OUT,
; and EMBEDDED where the Python lies in STAGE too. Without it, one of python.org is looked up, and gets a folder of its own from STAGE\wheels.
Target amd64-unicode
Name "AMR Scheduler"
OutFile "${OUT}"
RequestExecutionLevel admin
SetCompressor lzma
!include MUI2.nsh

!define UNINSTALL "Software\Microsoft\Windows\CurrentVersion\Uninstall\AMR Scheduler"
!ifdef EMBEDDED
  !define PYTHON "$INSTDIR\python"
!else
  !define PYTHON "$INSTDIR\python\Scripts"
  Var base      ; the folder of the installed Python
!endif

InstallDir "$PROGRAMFILES64\AMR Scheduler"
!insertmacro MUI_PAGE_DIRECTORY
!insertmacro MUI_PAGE_COMPONENTS
!insertmacro MUI_PAGE_INSTFILES
!insertmacro MUI_UNPAGE_CONFIRM
!insertmacro MUI_UNPAGE_INSTFILES
!insertmacro MUI_LANGUAGE "English"

Function .onInit
  SetRegView 64
  SetShellVarContext all
  ReadRegStr $0 HKLM "${UNINSTALL}" "InstallLocation"
  ${If} $0 != ""
    StrCpy $INSTDIR $0      ; an update goes where the app is
  ${EndIf}
!ifndef EMBEDDED
  !macro look VERSION
    ReadRegStr $base HKLM "Software\Python\PythonCore\${VERSION}\InstallPath" ""
    ${If} ${FileExists} "$base\python.exe"
      Return
    ${EndIf}
    ReadRegStr $base HKCU "Software\Python\PythonCore\${VERSION}\InstallPath" ""
    ${If} ${FileExists} "$base\python.exe"
      Return
    ${EndIf}
  !macroend
  !insertmacro look 3.12
  !insertmacro look 3.13
  !insertmacro look 3.11
  MessageBox MB_OK|MB_ICONSTOP "Python is missing. Install 64-bit Python 3.12 from python.org for all users, then start this again." /SD IDOK
  SetErrorLevel 2
  Quit
!endif
FunctionEnd

; Python's folder becomes python.old, whole or not at all: nothing is changed under an app that runs.
!macro is_free PROGRAM
  ${If} ${FileExists} "${PYTHON}\${PROGRAM}"
    FileOpen $0 "${PYTHON}\${PROGRAM}" a      ; an error for a program that runs
    FileClose $0
  ${EndIf}
!macroend
!macro set_aside
  ClearErrors
  !insertmacro is_free python.exe
  !insertmacro is_free pythonw.exe
  ${IfNot} ${Errors}
    Rename "$INSTDIR\python" "$INSTDIR\python.old"
  ${EndIf}
  ${If} ${Errors}
    MessageBox MB_OK|MB_ICONSTOP "AMR Scheduler is running. Close it, then start this again. Nothing was changed." /SD IDOK
    SetErrorLevel 2
    Quit
  ${EndIf}
!macroend

Section "AMR Scheduler"
  SectionIn RO
  SetOutPath "$INSTDIR"
  RMDir /r "$INSTDIR\python.old"
  ${If} ${FileExists} "$INSTDIR\python\*"
    !insertmacro set_aside
  ${EndIf}
  File /r "${STAGE}/*"
!ifdef EMBEDDED
  DetailPrint "Preparing the first start"
  nsExec::ExecToLog '"${PYTHON}\python.exe" -I -m compileall -q "$INSTDIR\python\Lib\site-packages"'
  Pop $0      ; a file that can't be compiled is compiled at each start
!else
  DetailPrint "Making a folder of its own for Python from $base"
  nsExec::ExecToLog '"$base\python.exe" -I -m venv "$INSTDIR\python"'
  Pop $0
  ${If} $0 == 0
    nsExec::ExecToLog '"${PYTHON}\python.exe" -I -m pip install --no-index --find-links "$INSTDIR\wheels" amr-scheduler[ui]==${VERSION}'
    Pop $0
  ${EndIf}
  RMDir /r "$INSTDIR\wheels"
!endif
  nsExec::ExecToStack '"${PYTHON}\python.exe" -I -m amr_scheduler --version'
  Pop $0
  Pop $1
  ${If} $0 != 0
    RMDir /r "$INSTDIR\python"
    Rename "$INSTDIR\python.old" "$INSTDIR\python"
    MessageBox MB_OK|MB_ICONSTOP "AMR Scheduler ${VERSION} does not start here: $1$\r$\nThe version that was here before, if any, is back." /SD IDOK
    SetErrorLevel 1
    Quit
  ${EndIf}
  RMDir /r "$INSTDIR\python.old"

  FileOpen $0 "$INSTDIR\amr-scheduler.cmd" w
  FileWrite $0 '@"${PYTHON}\python.exe" -I -m amr_scheduler %*$\r$\n'
  FileClose $0
  CreateShortcut "$SMPROGRAMS\AMR Scheduler.lnk" "${PYTHON}\pythonw.exe" "-I -m amr_scheduler"
  WriteUninstaller "$INSTDIR\uninstall.exe"
  WriteRegStr HKLM "${UNINSTALL}" "DisplayName" "AMR Scheduler"
  WriteRegStr HKLM "${UNINSTALL}" "DisplayVersion" "${VERSION}"
  WriteRegStr HKLM "${UNINSTALL}" "InstallLocation" "$INSTDIR"
  WriteRegStr HKLM "${UNINSTALL}" "UninstallString" '"$INSTDIR\uninstall.exe"'
  WriteRegStr HKLM "${UNINSTALL}" "QuietUninstallString" '"$INSTDIR\uninstall.exe" /S'
  WriteRegDWORD HKLM "${UNINSTALL}" "NoModify" 1
  WriteRegDWORD HKLM "${UNINSTALL}" "NoRepair" 1
SectionEnd

Section /o "Start when somebody signs in, and fill the screen"
  CreateShortcut "$SMSTARTUP\AMR Scheduler.lnk" "${PYTHON}\pythonw.exe" "-I -m amr_scheduler --kiosk"
SectionEnd

Section "un.AMR Scheduler"      ; the data, in each user's AppData\Local\amr-scheduler, stay
  SetRegView 64
  SetShellVarContext all
  !insertmacro set_aside
  RMDir /r "$INSTDIR\python.old"
  Delete "$INSTDIR\amr-scheduler.cmd"
  Delete "$INSTDIR\uninstall.exe"
  RMDir "$INSTDIR"
  Delete "$SMPROGRAMS\AMR Scheduler.lnk"
  Delete "$SMSTARTUP\AMR Scheduler.lnk"
  DeleteRegKey HKLM "${UNINSTALL}"
SectionEnd
